"""The planner's server: what it hands out, to whom, and what it refuses."""

import asyncio
import gzip
import http.client
import json
import threading
import time
from collections.abc import Callable
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

import braidcast
from braidcast.planner import jobs
from braidcast.planner.contents import Contents
from braidcast.planner.model_arrays import unpack
from braidcast.planner.opened_case import DEFAULT, OpenedCase
from braidcast.planner.pages import STATIC
from braidcast.planner.server import LARGEST_BODY, application

ONE, OTHER = "session-one", "session-two"


class Client:
    """Requests as they are written, which no library puts in order; answers as they come."""

    def __init__(self, port: int, session: str = ONE) -> None:
        self.port, self.session = port, session

    def __call__(self, method: str, path: str, body: bytes | None = None, **headers: str):
        headers = {"X-Braidcast-Session": self.session, **headers}
        connection = http.client.HTTPConnection("127.0.0.1", self.port, timeout=60)
        connection.putrequest(method, path, "Host" in headers, skip_accept_encoding=True)
        if body is not None:
            headers.setdefault("Content-Length", str(len(body)))
        for name, value in headers.items():
            connection.putheader(name.replace("_", "-"), value)
        connection.endheaders(body)
        answer = connection.getresponse()
        content = answer.read()
        connection.close()
        return SimpleNamespace(status=answer.status, headers=answer.headers, content=content)

    def post(self, case: object):
        return self("POST", "/api/jobs", json.dumps({"case": case}).encode())

    def started(self, case: object) -> str:
        """The id of a new simulation."""
        answer = self.post(case)
        assert answer.status == 202, answer.content
        return json.loads(answer.content)["id"]

    def job(self, identity: str) -> dict:
        answer = self("GET", f"/api/jobs/{identity}")
        assert answer.status == 200
        return json.loads(answer.content)

    def ended(self, identity: str, seconds: float = 60.0) -> dict:
        """The status of a simulation when it has ended."""
        until = time.monotonic() + seconds
        while (job := self.job(identity))["state"] in ("queued", "running"):
            assert time.monotonic() < until, job
            time.sleep(0.02)
        return job


def said(answer) -> str:
    return json.loads(answer.content)["error"]


class Slow:
    """Simulations that wait until they are told what to do; the title of a case is its result."""

    def __init__(self) -> None:
        self.go = threading.Semaphore(0)
        self.begun: list[str] = []
        self.ended: list[str] = []

    async def __call__(self, tables, report) -> bytes:
        title = tables["title"]
        self.begun.append(title)
        try:
            report("crimp", 0.25)
            while not self.go.acquire(blocking=False):
                await asyncio.sleep(0.005)
            if title == "bad":
                raise ZeroDivisionError("a defect")
            return title.encode()
        finally:
            self.ended.append(title)


def titled(title: str) -> dict:
    return {**DEFAULT, "title": title}


@pytest.fixture
def client(server) -> Client:
    return Client(server.port)


@pytest.fixture
def slow() -> Slow:
    return Slow()


@pytest.fixture
def queue(serving: Callable, contents: Contents, slow: Slow):
    """A client of a server whose simulations are ``slow``."""
    with serving(application(contents, simulate=slow)) as served:
        yield Client(served.port)


def wait(true: Callable[[], bool]) -> None:
    until = time.monotonic() + 20.0
    while not true():
        assert time.monotonic() < until
        time.sleep(0.01)


def test_the_page_and_its_files(client: Client) -> None:
    page = client("GET", "/")
    assert page.status == 200 and b"<!doctype html>" in page.content.lower()
    for name in ("app.js", "planner.css", "vendor/three.module.min.js"):
        if (STATIC / name).is_file():
            answer = client("GET", f"/static/{name}")
            assert answer.content == (STATIC / name).read_bytes()
    module = client("GET", "/static/model.js")
    assert module.headers["content-type"].startswith("text/javascript")
    again = client("GET", "/static/model.js", If_None_Match=module.headers["etag"])
    assert again.status == 304


def test_what_it_starts_with(client: Client) -> None:
    start = json.loads(client("GET", "/api/start").content)
    assert start["version"] == braidcast.__version__
    assert braidcast.Case.from_dict(start["case"]).eta == start["case"]["site"]["eta"] == 0.5
    assert start["modelName"] and start["card"].startswith("# Model card")
    assert start["surface"] is None and start["withoutModel"] is None
    assert start["device"]["wires"] == 48


def test_the_model_travels_packed(client: Client) -> None:
    plain = client("GET", "/api/model").content
    packed = client("GET", "/api/model", Accept_Encoding="gzip, br")
    assert packed.headers["content-encoding"] == "gzip"
    assert gzip.decompress(packed.content) == plain
    header, arrays = unpack(plain)
    assert header["device"]["wires"] == 48 and len(arrays["mean"]) == 3 * 3408


def test_page_and_model_are_small(client: Client) -> None:
    paths = [
        f"/static/{path.relative_to(STATIC).as_posix()}"
        for path in STATIC.rglob("*")
        if path.suffix in (".js", ".css")
    ]
    sizes = [
        len(client("GET", path, Accept_Encoding="gzip").content)
        for path in ("/", "/api/start", "/api/model", *paths)
    ]
    assert sum(sizes) < 5e6


def test_the_default_case_is_the_example() -> None:
    example = Path(__file__).parents[2] / "examples" / "success.toml"
    assert OpenedCase.default() == OpenedCase.from_toml(example)


def test_a_simulation_is_that_of_the_library(client: Client, tables: dict) -> None:
    identity = client.started(tables)
    assert client("GET", f"/api/jobs/{identity}/result").status in (200, 409)
    job = client.ended(identity)
    assert (job["state"], job["message"]) == ("done", "")
    header, arrays = unpack(client("GET", f"/api/jobs/{identity}/result").content)
    expected = braidcast.simulate(braidcast.Case.from_dict(tables))
    assert np.abs(arrays["positions"] - expected.positions).max() < 1e-9
    assert np.abs(arrays["gaps"] - expected.wire_distance).max() < 1e-9
    assert header["outcome"] == expected.outcome and header["converged"]
    assert header["deployed_length_mm"] == pytest.approx(expected.deployed_length_mm)
    assert header["device"]["wires"] == 12


def test_one_runs_the_others_wait_in_order(queue: Client, slow: Slow) -> None:
    first, second, third = (queue.started(titled(name)) for name in "abc")
    wait(lambda: slow.begun == ["a"])
    assert [queue.job(each)["position"] for each in (first, second, third)] == [0, 1, 2]
    running = queue.job(first)
    assert (running["state"], running["stage"], running["fraction"]) == ("running", "crimp", 0.25)
    assert queue.job(third)["state"] == "queued"
    assert "is queued" in said(queue("GET", f"/api/jobs/{third}/result"))
    slow.go.release(3)
    for identity, name in ((first, b"a"), (second, b"b"), (third, b"c")):
        assert queue.ended(identity)["state"] == "done"
        assert queue("GET", f"/api/jobs/{identity}/result").content == name
    assert slow.begun == ["a", "b", "c"]


def test_cancelled_whether_it_runs_or_waits(queue: Client, slow: Slow) -> None:
    first, second, third = (queue.started(titled(name)) for name in "abc")
    wait(lambda: slow.begun == ["a"])
    for identity in (second, first, first):
        answer = queue("DELETE", f"/api/jobs/{identity}")
        assert answer.status == 200 and json.loads(answer.content)["state"] == "cancelled"
    slow.go.release()
    assert queue.ended(third)["state"] == "done"
    assert slow.ended == ["a", "c"]
    assert queue.job(first)["state"] == queue.job(second)["state"] == "cancelled"
    assert json.loads(queue("DELETE", f"/api/jobs/{third}").content)["state"] == "done"


def test_a_defect_in_a_simulation_is_its_own_failure(queue: Client, slow: Slow) -> None:
    bad, good = queue.started(titled("bad")), queue.started(titled("good"))
    slow.go.release(2)
    assert queue.ended(bad) == {**queue.job(bad), "state": "failed"}
    assert "a defect" in queue.job(bad)["message"]
    assert queue.ended(good)["state"] == "done"


def test_no_session_has_too_many_nor_all_together(queue: Client, slow: Slow) -> None:
    clients = [Client(queue.port, f"session-{n}") for n in range(6)]
    for _ in range(jobs.MOST_OF_A_SESSION):
        clients[0].started(titled("x"))
    answer = clients[0].post(titled("x"))
    assert answer.status == 429 and said(answer).startswith("5 simulations of this page")
    wait(lambda: len(slow.begun) == 1)  # one runs, four of the first session wait
    for client in clients[1:4]:
        for _ in range(5):
            client.started(titled("x"))
    clients[4].started(titled("x"))
    answer = clients[5].post(titled("x"))
    assert answer.status == 429 and said(answer).startswith("20 simulations are queued")


def test_only_the_last_results_are_kept(
    serving: Callable, contents: Contents, slow: Slow, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(jobs, "MOST_KEPT", 2)
    with serving(application(contents, simulate=slow)) as served:
        client = Client(served.port)
        slow.go.release(3)
        ended = [client.started(titled(name)) for name in "abc"]
        client.ended(ended[-1])
        assert [client("GET", f"/api/jobs/{each}").status for each in ended] == [404, 200, 200]


def test_a_session_sees_its_own_only(queue: Client, slow: Slow) -> None:
    identity = queue.started(titled("mine"))
    slow.go.release()
    queue.ended(identity)
    other = Client(queue.port, OTHER)
    for method, path in (("GET", ""), ("GET", "/result"), ("DELETE", "")):
        assert other(method, f"/api/jobs/{identity}{path}").status == 404
    for nobody in ("", "x", "a b c d e f", "x" * 65):
        assert Client(queue.port, nobody)("GET", f"/api/jobs/{identity}").status == 400
    assert queue("GET", f"/api/jobs/{identity}/result").content == b"mine"


def test_ten_sessions_at_once_get_what_is_theirs(queue: Client, slow: Slow) -> None:
    slow.go.release(30)
    wrong: list[object] = []

    def session(number: int) -> None:
        try:
            client = Client(queue.port, f"session-{number}")
            asked = client.started(titled(f"{number}"))
            start = json.loads(client("GET", "/api/start").content)
            content = client("GET", "/api/model", Accept_Encoding="gzip").content
            ended = client.ended(asked)
            result = client("GET", f"/api/jobs/{asked}/result").content
            if ended["state"] != "done" or result != f"{number}".encode() or not content:
                wrong.append((number, ended, result))
            assert start["case"]
        except Exception as error:
            wrong.append(error)

    threads = [threading.Thread(target=session, args=(number,)) for number in range(10)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert not wrong
    assert sorted(slow.begun) == sorted(map(str, range(10)))


@pytest.mark.parametrize(
    "body",
    [b"", b"{", b"[]", b"null", b'{"case": 3}', b"\xff\xfe", b"[" * 90_000, b'{"kase": {}}'],
)
def test_what_is_no_json_of_a_case_is_refused(client: Client, body: bytes) -> None:
    answer = client("POST", "/api/jobs", body)
    assert answer.status == 400 and said(answer).startswith("the request")


@pytest.mark.parametrize(
    ("table", "change", "sentence"),
    [
        ("vessel", {"diameter": -1}, "vessel.diameter = -1"),
        ("vessel", {"diameter": float("nan")}, "vessel.diameter"),
        ("vessel", {"diameter": 1e999}, "vessel.diameter"),
        ("vessel", {"diameter": "3 mm"}, "vessel.diameter"),
        ("vessel", {"P1": [0, 0]}, "vessel.P1"),
        ("vessel", {"nonsense": 1}, "vessel.nonsense"),
        ("vessel", {"nonsense\ud800": 1}, "vessel = {"),
        ("site", {"eta": 1.5}, "site.eta = 1.5"),
        ("site", {"eta": True}, "site.eta"),
        ("device", {"name": "\ud800"}, "device"),
        ("device", {"wires": 400, "wire_radius": 0.003}, "device.wires and device.segments give"),
        ("vessel", {"surface": "/etc/passwd"}, "vessel.surface must not be given"),
        ("vessel", {"centreline": "/etc/passwd"}, "vessel.centreline must not be given"),
        ("aneurysm", {"surface": "/etc/passwd"}, "aneurysm.surface must not be given"),
    ],
)
def test_a_nonsense_case_is_refused_in_one_sentence(
    client: Client, table: str, change: dict, sentence: str
) -> None:
    case = {**DEFAULT, table: {**DEFAULT.get(table, {}), **change}}
    answer = client.post(case)
    assert answer.status == 422
    assert said(answer).startswith(sentence)
    assert client("GET", "/api/alive").status == 200


def test_a_title_may_be_anything_but_not_long(client: Client) -> None:
    assert client.post(titled("x" * 201)).status == 422
    assert client.post({**DEFAULT, "title": 3}).status == 422


@pytest.mark.parametrize("size", [LARGEST_BODY + 1, 5_000_000])
def test_a_large_body_is_refused(client: Client, size: int) -> None:
    answer = client("POST", "/api/jobs", b" " * size)
    assert answer.status == 413 and "100000" in said(answer)
    assert client("GET", "/api/alive").status == 200


@pytest.mark.parametrize(
    "path",
    [
        "/static/../server.py",
        "/static/../../case.py",
        "/static/%2e%2e/server.py",
        "/static/..%2fserver.py",
        "/static/..%5cserver.py",
        "/static//etc/passwd",
        "/static/%2fetc%2fpasswd",
        "/static/%00",
        "/static/" + "a" * 5000,
        "/static/",
        "/static/vendor",
        "/../planner/server.py",
        "/server.py",
        "/api/jobs/../../static",
        "/api/nothing",
    ],
)
def test_nothing_outside_the_folder_is_read(client: Client, path: str) -> None:
    answer = client("GET", path)
    assert answer.status == 404, (answer.status, answer.content[:200])
    assert b"import" not in answer.content and b"root:" not in answer.content


def test_no_link_leads_out_of_the_folder(
    serving: Callable, contents: Contents, tmp_path: Path
) -> None:
    static = tmp_path / "static"
    static.mkdir()
    (static / "index.html").write_text("<!doctype html>")
    (tmp_path / "secret.txt").write_text("secret")
    (static / "link.txt").symlink_to(tmp_path / "secret.txt")
    with serving(application(contents, static=static)) as served:
        assert Client(served.port)("GET", "/static/index.html").status == 200
        assert Client(served.port)("GET", "/static/link.txt").status == 404


@pytest.mark.parametrize("method", ["POST", "PUT", "DELETE", "PATCH", "TRACE"])
@pytest.mark.parametrize("path", ["/", "/static/model.js", "/api/start", "/api/alive"])
def test_methods_that_mean_nothing_here_are_refused(client: Client, method: str, path: str) -> None:
    assert client(method, path, b"{}").status == 405


@pytest.mark.parametrize(
    ("host", "status"),
    [
        ("localhost", 200),
        ("LOCALHOST:8765", 200),
        ("127.0.0.1:1", 200),
        ("[::1]:8765", 200),
        ("evil.example", 403),
        ("127.0.0.1.evil.example", 403),
        ("localhost@evil.example", 403),
        ("[", 403),
        ("", 403),
    ],
)
def test_it_answers_to_this_machine_only(client: Client, host: str, status: int) -> None:
    for path in ("/", "/api/alive", "/static/model.js"):
        assert client("GET", path, Host=host).status == status


def test_any_name_where_a_host_was_given(serving: Callable, contents: Contents) -> None:
    with serving(application(contents, any_host=True)) as served:
        assert Client(served.port)("GET", "/api/alive", Host="clinic.example").status == 200


def test_the_page_may_do_little(client: Client) -> None:
    for path in ("/", "/static/model.js", "/api/alive", "/nothing"):
        headers = client("GET", path).headers
        assert "unsafe" not in headers["content-security-policy"]
        assert "default-src 'none'" in headers["content-security-policy"]
        assert headers["x-content-type-options"] == "nosniff"
        assert "access-control-allow-origin" not in headers
