"""The page as the server sends it, and as one file that needs no server.

Everything in ``static/`` is plain: index.html names a style sheet, an import map and a module by
``"./name"``; modules import each other by ``"./name.js"`` and by the names of the import map. In
the single file each module is a data: URL of a larger import map, under a name of its own, because
a relative name leads nowhere from such a URL; nothing else in a module is changed.
"""

from __future__ import annotations

import base64
import hashlib
import json
import mimetypes
import posixpath
import re
from collections.abc import Callable
from importlib.resources import files
from pathlib import Path

from braidcast.planner.contents import Contents

STATIC = Path(str(files("braidcast.planner").joinpath("static")))

_PREFIX = "planner/"

_INLINE_SCRIPT = re.compile(r"<script\b(?![^>]*\bsrc\s*=)[^>]*>(.*?)</script>", re.S | re.I)
_IMPORT_MAP = re.compile(r"<script\s+type=\"importmap\"\s*>(.*?)</script>", re.S | re.I)
_MODULE = re.compile(r"<script\b[^>]*\btype=\"module\"[^>]*\bsrc=\"([^\"]+)\"[^>]*>\s*</script>")
_STYLE = re.compile(r"<link\b[^>]*\brel=\"stylesheet\"[^>]*\bhref=\"([^\"]+)\"[^>]*>")
_PRELOAD = re.compile(r"\s*<link\b[^>]*\brel=\"(?:modulepreload|preload|manifest)\"[^>]*>")
_HEAD = re.compile(r"<head\b[^>]*>\s*<meta charset=[^>]*>")
_RESOURCE = re.compile(r"\b(src|href)=\"((?!data:|https?:|#|mailto:)[^\"]+)\"")
_SPECIFIER = re.compile(r"(\bfrom\s*|\bimport\s*\(?\s*)([\"'])(\.{1,2}/[^\"'\n]+)\2")

#: Nothing is fetched from anywhere: the file is all there is.
_FILE_POLICY = (
    "default-src 'none'; script-src 'unsafe-inline' data: blob:; worker-src blob: data:; "
    "style-src 'unsafe-inline'; img-src data: blob:; font-src data:; connect-src data: blob:; "
    "form-action 'none'; base-uri 'none'"
)


def policy(page: str) -> str:
    """The content security policy of the page: our files alone, and its import map."""
    hashes = "".join(
        f" 'sha256-{base64.b64encode(hashlib.sha256(script.encode()).digest()).decode()}'"
        for script in _INLINE_SCRIPT.findall(page)
    )
    return (
        f"default-src 'none'; script-src 'self'{hashes}; worker-src 'self' blob:; "
        "style-src 'self'; img-src 'self' data: blob:; font-src 'self'; connect-src 'self'; "
        "form-action 'none'; base-uri 'none'; frame-ancestors 'none'"
    )


def single_file(contents: Contents, static: Path = STATIC) -> str:
    """The whole planner in one HTML file.

    Beside the page it has two elements, from which the page knows that there is no server:
    ``<script type="application/json" id="planner-start">``, what ``/api/start`` answers, and
    ``<script type="text/plain" id="planner-model">``, the model's arrays, gzip in base64, or empty.
    """
    names = sorted(
        path.relative_to(static).as_posix() for path in static.rglob("*") if path.is_file()
    )
    page = (static / "index.html").read_text("utf-8")
    imports = _imports(page, static, names)

    def style(found: re.Match[str]) -> str:
        return f"<style>\n{(static / _name(found[1])).read_text('utf-8')}</style>"

    def module(found: re.Match[str]) -> str:
        return f'<script type="module">import "{_PREFIX}{_name(found[1])}";</script>'

    def resource(found: re.Match[str]) -> str:
        return f'{found[1]}="{_data_url(static / _name(found[2]))}"'

    page = _PRELOAD.sub("", page)
    page = _only(_IMPORT_MAP, page, lambda _: _script("importmap", {"imports": imports}))
    page = _STYLE.sub(style, page)
    page = _only(_MODULE, page, module)
    page = _outside_scripts(page, lambda text: _RESOURCE.sub(resource, text))
    model = contents.model
    packed = "" if model is None else base64.b64encode(model.gzipped).decode()
    added = (
        f'<meta http-equiv="Content-Security-Policy" content="{_FILE_POLICY}">\n'
        f"{_script('application/json', json.loads(contents.start.plain), 'planner-start')}\n"
        f'<script type="text/plain" id="planner-model">{packed}</script>'
    )
    return _only(_HEAD, page, lambda found: f"{found[0]}\n{added}")


def _imports(page: str, static: Path, names: list[str]) -> dict[str, str]:
    """The import map of the single file: every module by its own name and by those of the page."""
    modules = [name for name in names if name.endswith(".js")]
    imports = {_PREFIX + name: _module_url(static, name, modules) for name in modules}
    found = _IMPORT_MAP.search(page)
    given = json.loads(found[1])["imports"] if found else {}
    for alias, target in given.items():
        if alias.endswith("/"):
            folder = _name(target)
            aliases = {alias + m.removeprefix(folder): m for m in modules if m.startswith(folder)}
        else:
            aliases = {alias: _name(target)}
        imports |= {each: imports[_PREFIX + name] for each, name in aliases.items()}
    return imports


def _module_url(static: Path, name: str, modules: list[str]) -> str:
    """A data: URL of a module that names the others as the import map does."""

    def renamed(found: re.Match[str]) -> str:
        target = posixpath.normpath(posixpath.join(posixpath.dirname(name), found[3]))
        if target not in modules:
            return found[0]
        return f"{found[1]}{found[2]}{_PREFIX}{target}{found[2]}"

    return _url("text/javascript", _SPECIFIER.sub(renamed, (static / name).read_text("utf-8")))


def _name(reference: str) -> str:
    """What "./name" in index.html is called."""
    return reference.removeprefix("./")


def _data_url(path: Path) -> str:
    kind = mimetypes.guess_type(path.name)[0] or "application/octet-stream"
    return f"data:{kind};base64,{base64.b64encode(path.read_bytes()).decode()}"


def _url(kind: str, text: str) -> str:
    return f"data:{kind};charset=utf-8;base64,{base64.b64encode(text.encode()).decode()}"


def _script(kind: str, content: object, identity: str = "") -> str:
    named = f' id="{identity}"' if identity else ""
    # "</script>" in a text would end the element; "<" may be written so in JSON.
    text = json.dumps(content).replace("<", "\\u003c")
    return f'<script type="{kind}"{named}>{text}</script>'


def _only(pattern: re.Pattern[str], page: str, by: Callable[[re.Match[str]], str]) -> str:
    """The page with the one place of a pattern replaced."""
    changed, count = pattern.subn(by, page)
    if count != 1:
        raise RuntimeError(f"index.html has {count} places like {pattern.pattern}, must have one")
    return changed


def _outside_scripts(page: str, change: Callable[[str], str]) -> str:
    parts = re.split(r"(<(?:script|style)\b.*?</(?:script|style)>)", page, flags=re.S)
    return "".join(part if i % 2 else change(part) for i, part in enumerate(parts))
