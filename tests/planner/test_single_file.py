"""The planner in one file: whatever modules there are, they run from a disk, and fetch nothing."""

from collections.abc import Callable
from pathlib import Path

import pytest
from playwright.sync_api import Page, expect

from braidcast.planner.contents import Contents
from braidcast.planner.opened_case import OpenedCase
from braidcast.planner.pages import STATIC, single_file

FILES = {
    "index.html": """<!doctype html>
<html lang="en">
<head>
<meta charset="utf-8">
<link rel="icon" href="./icon.svg">
<link rel="stylesheet" href="./page.css">
<script type="importmap">{"imports": {"three": "./vendor/three.js", "more/": "./vendor/"}}</script>
<script type="module" src="./app.js"></script>
</head>
<body><img id="icon" src="./icon.svg"><p id="said"></p></body>
</html>
""",
    "page.css": "#said { color: rgb(1, 2, 3); }\n",
    "icon.svg": '<svg xmlns="http://www.w3.org/2000/svg" width="7" height="5"/>',
    "app.js": """import { half } from "./lib/half.js";
import * as THREE from "three";
import { orbit } from "more/orbit.js";
const text = "</script> from './nowhere.js' µ";
const start = JSON.parse(document.getElementById("planner-start").textContent);
const packed = document.getElementById("planner-model").textContent;
const bytes = Uint8Array.from(atob(packed), (letter) => letter.charCodeAt(0));
const unzipped = new Blob([bytes]).stream().pipeThrough(new DecompressionStream("gzip"));
const size = (await new Response(unzipped).arrayBuffer()).byteLength;
const source = URL.createObjectURL(new Blob(["onmessage = ({ data }) => postMessage(data + 1)"]));
const worker = new Worker(source);
worker.onmessage = async ({ data }) => {
  const { late } = await import("./late.js");
  document.getElementById("said").textContent = JSON.stringify(
    { half: half(4), core: THREE.core, orbit, text, title: start.case.title, size, data, late });
};
worker.postMessage(1);
""",
    "late.js": 'export const late = "late";\n',
    "lib/half.js": 'import {two}from"../two.js";\nexport function half(x) { return x / two; }\n',
    "two.js": "export const two = 2;\n",
    "vendor/three.js": 'import{c as e}from"./core.js";export{e as core};\n',
    "vendor/core.js": 'const c="core";export{c};\n',
    "vendor/orbit.js": 'import { core } from "three";\nexport const orbit = `around ${core}`;\n',
}


@pytest.fixture
def static(tmp_path: Path) -> Path:
    for name, text in FILES.items():
        path = tmp_path / "static" / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text, "utf-8")
    return tmp_path / "static"


def test_it_runs_from_a_disk(
    contents: Contents, static: Path, tmp_path: Path, browser_page: Page
) -> None:
    path = tmp_path / "elsewhere" / "a planner #1.html"
    path.parent.mkdir()
    path.write_text(single_file(contents, static), "utf-8")
    asked: list[str] = []
    browser_page.on("request", lambda request: asked.append(request.url))
    browser_page.goto(path.as_uri())
    expect(browser_page.locator("#said")).not_to_be_empty()
    said = browser_page.evaluate("JSON.parse(document.getElementById('said').textContent)")
    assert said == {
        "half": 2,
        "core": "core",
        "orbit": "around core",
        "text": "</script> from './nowhere.js' µ",
        "title": contents.opened.case.title,
        "size": len(contents.model.plain),
        "data": 2,
        "late": "late",
    }
    assert browser_page.evaluate("getComputedStyle(document.getElementById('said')).color") == (
        "rgb(1, 2, 3)"
    )
    assert browser_page.evaluate("document.getElementById('icon').naturalWidth") == 7
    assert {url.split(":")[0] for url in asked} <= {"file", "data", "blob"}
    assert sum(url.startswith("file:") for url in asked) == 1


def test_it_may_ask_nobody(
    contents: Contents, static: Path, tmp_path: Path, browser_page: Page, troubles: list[str]
) -> None:
    path = tmp_path / "planner.html"
    path.write_text(single_file(contents, static), "utf-8")
    browser_page.goto(path.as_uri())
    refused = "fetch('http://127.0.0.1:9/').then(() => 'answered', (error) => error.name)"
    assert browser_page.evaluate(refused) == "TypeError"
    assert any("Content Security Policy" in trouble for trouble in troubles)
    troubles.clear()


def test_a_page_that_the_loader_does_not_know_is_not_written(
    contents: Contents, static: Path
) -> None:
    page = static / "index.html"
    page.write_text(page.read_text().replace('<script type="module" src="./app.js"></script>', ""))
    with pytest.raises(RuntimeError, match="must have one"):
        single_file(contents, static)


def test_the_same_modules_run_from_the_server(
    serving: Callable, contents: Contents, static: Path, browser_page: Page
) -> None:
    from braidcast.planner.server import application

    app = static / "app.js"
    server_only = "const start = await (await fetch('api/start')).json();"
    text = app.read_text("utf-8").splitlines()
    kept = [line for line in text if "planner-" not in line and "packed" not in line]
    body = "\n".join([server_only, "const size = 0;", *kept])
    app.write_text("\n".join(line for line in body.splitlines() if "unzipped" not in line), "utf-8")
    with serving(application(contents, static=static)) as served:
        browser_page.goto(served.url)
        expect(browser_page.locator("#said")).not_to_be_empty()
        assert "around core" in browser_page.inner_text("#said")
        browser_page.goto("about:blank")


def test_the_planner_itself_is_one_file(contents: Contents) -> None:
    page = single_file(contents)
    assert 'src="./' not in page and 'href="./' not in page
    assert all(f'"planner/{path.name}"' in page for path in STATIC.glob("*.js"))
    assert len(page) < 8e6
    assert OpenedCase.default().case.title in page
