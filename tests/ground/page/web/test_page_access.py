"""Who may do what at the operator's page: tokens, cookies, Host, Origin, and the headers of every answer."""

import asyncio
import json
import re

import pytest

from ground.page.web import access
from ground.page.web.access import Role, Tokens, cookie_name, cookie_value, hosts_of, stored_tokens
from ground.page.web.guard import Gate, Guard, Refusal, judge
from onboard.config import ConfigError

TOKENS = Tokens("o" * 32, "v" * 32)
GATE = Gate(TOKENS, hosts_of("127.0.0.1", 8765), 8765)
HOST = "127.0.0.1:8765"


def headers(role=None, **more):
    shown = {} if role is None else {"cookie": f"{cookie_name(8765)}={cookie_value(TOKENS, role)}"}
    return {"host": HOST, **shown, **more}


@pytest.mark.parametrize(("token", "role"), [
    ("o" * 32, Role.OPERATOR), ("v" * 32, Role.VIEWER), (" " + "v" * 32 + "\n", Role.VIEWER), ("o" * 31, None),
    ("", None), ("ö" * 32, None), ("\udc80", None),
])  # fmt: skip
def test_a_token_opens_its_role_only(token, role):
    assert access.role_of_token(TOKENS, token) is role


def test_tokens_and_cookies_are_compared_in_constant_time(monkeypatch):
    compared = []

    def compare(a, b):
        compared.append((a, b))
        return a == b

    monkeypatch.setattr(access.hmac, "compare_digest", compare)
    access.role_of_token(TOKENS, "o" * 32)
    access.role_of_cookies(TOKENS, f"{cookie_name(1)}=x", cookie_name(1))
    assert len(compared) == 4  # both roles each time, also after the first fits


def test_a_cookie_does_not_show_the_token_and_ends_with_it():
    value = cookie_value(TOKENS, Role.OPERATOR)
    assert TOKENS.operator not in value and value != cookie_value(TOKENS, Role.VIEWER)
    header = f"a=b; {cookie_name(8765)}={value}; c=d"
    assert access.role_of_cookies(TOKENS, header, cookie_name(8765)) is Role.OPERATOR
    assert access.role_of_cookies(Tokens("n" * 32, "v" * 32), header, cookie_name(8765)) is None
    assert access.role_of_cookies(TOKENS, header, cookie_name(9000)) is None


@pytest.mark.parametrize("foreign", [
    'x={"a":1}', "flag", "a=b=c", '="', f"{cookie_name(8765)}x=1", f"{cookie_name(8765)}=old", "x=ö,[]", "",
])  # fmt: skip
@pytest.mark.parametrize("order", [1, -1])
def test_a_cookie_of_another_server_on_this_computer_hides_ours_in_no_syntax(foreign, order):
    ours = f"{cookie_name(8765)}={cookie_value(TOKENS, Role.OPERATOR)}"
    header = "; ".join((foreign, ours)[::order])
    assert access.role_of_cookies(TOKENS, header, cookie_name(8765)) is Role.OPERATOR
    assert access.role_of_cookies(TOKENS, f"{foreign}; x{ours}", cookie_name(8765)) is None


def test_tokens_are_made_once_in_a_file_that_only_its_owner_reads(tmp_path):
    path = tmp_path / "station" / "page-tokens.json"
    made = stored_tokens(path)
    assert stored_tokens(path) == made and path.stat().st_mode & 0o777 == 0o600
    assert made.operator != made.viewer and all(len(one) >= 32 for one in made)


@pytest.mark.parametrize(("text", "mode", "words"), [
    (json.dumps(TOKENS._asdict()), 0o640, "others may read"), ("{", 0o600, "damaged"), ("[]", 0o600, "damaged"),
    (json.dumps({"operator": "a", "viewer": "b"}), 0o600, "under 24 characters"),
    (json.dumps({"operator": "o" * 32, "viewer": "o" * 32}), 0o600, "same token"),
])  # fmt: skip
def test_a_bad_token_file_stops_the_start_and_shows_no_token(tmp_path, text, mode, words):
    path = tmp_path / "tokens.json"
    path.write_text(text)
    path.chmod(mode)
    with pytest.raises(ConfigError, match=words) as error:
        stored_tokens(path)
    assert "o" * 32 not in str(error.value) and str(path) in str(error.value)


@pytest.mark.parametrize(("kind", "path", "given", "found"), [
    ("http", "/", headers(), 401), ("http", "/", headers(Role.VIEWER), Role.VIEWER),
    ("http", "/", headers(Role.OPERATOR), Role.OPERATOR), ("http", "/sign-in", headers(), None),
    ("websocket", "/sign-in", headers(origin=f"http://{HOST}"), 401),
    ("http", "/", headers(Role.OPERATOR, host="evil.example:8765"), 421), ("http", "/", headers(host=""), 421),
    ("http", "/stop", headers(Role.OPERATOR, origin="http://evil.example"), 403),
    ("http", "/stop", headers(Role.OPERATOR, origin="null"), 403),
    ("http", "/stop", headers(Role.OPERATOR, origin="http://127.0.0.1:9"), 403),
    ("http", "/stop", headers(Role.OPERATOR, origin=f"http://{HOST}"), Role.OPERATOR),
    ("websocket", "/x", headers(Role.OPERATOR), 403),
    ("websocket", "/x", headers(Role.OPERATOR, origin="http://evil.example"), 403),
    ("websocket", "/x", headers(Role.OPERATOR, origin=f"http://{HOST}"), Role.OPERATOR),
    ("http", "/", headers(cookie='a="'), 401), ("http", "/static/map.js", headers(), 401),
    ("http", "/sign-in", headers(origin="http://[bad"), 403),
])  # fmt: skip
def test_the_guard_judges_host_origin_and_role(kind, path, given, found):
    judged = judge(GATE, kind, "GET", path, given)
    assert (judged.status if isinstance(judged, Refusal) else judged) == found


def test_a_name_is_added_with_and_without_its_port():
    assert {"rover.example:8765", "proxy:1"} <= hosts_of("0.0.0.0", 8765, ("Rover.example", "proxy:1"))
    assert "[::1]:80" in hosts_of("::1", 80) and "localhost" in hosts_of("::1", 80)


async def _page(scope, receive, send):
    await send(
        {
            "type": "http.response.start",
            "status": 200,
            "headers": [
                (b"content-type", b"text/html; charset=utf-8"),
                (b"content-length", b"9"),
                (b"x-frame-options", b"ALLOWALL"),
            ],
        }
    )
    for part in (b"<script>1</scr", b"ipt><script src=/a></script>&lt;script>"):
        await send({"type": "http.response.body", "body": part, "more_body": part.endswith(b"scr")})


def answer(app, role, kind="http", path="/", **more):
    sent = []

    async def send(message):
        sent.append(message)

    given = [(name.encode(), value.encode()) for name, value in headers(role, **more).items()]
    asyncio.run(Guard(app, GATE)({"type": kind, "method": "GET", "path": path, "headers": given}, None, send))
    return sent


def test_every_answer_forbids_frames_and_foreign_scripts_and_each_page_has_its_own_nonce():
    nonces = set()
    for _ in range(2):
        start, body = answer(_page, Role.VIEWER)
        found = dict(start["headers"])
        policy = found[b"content-security-policy"].decode()
        nonce = re.search(r"'nonce-([^']+)'", policy)[1]
        nonces.add(nonce)
        assert body["body"].count(f'<script nonce="{nonce}"'.encode()) == 2 and b"&lt;script>" in body["body"]
        assert found[b"x-frame-options"] == b"DENY" and "frame-ancestors 'none'" in policy
        assert "script-src 'self'" in policy and "'unsafe-inline'" not in policy.split("style-src")[0]
        assert int(found[b"content-length"]) == len(body["body"]) and found[b"cache-control"] == b"no-store"
    assert len(nonces) == 2


def test_a_stranger_reaches_no_code_behind_the_guard():
    async def never(scope, receive, send):
        raise AssertionError("reached")

    assert answer(never, None)[0]["status"] == 401
    assert answer(never, None, accept="text/html")[0]["status"] == 303
    assert answer(never, None, "websocket", origin=f"http://{HOST}") == [{"type": "websocket.close", "code": 1008}]
    assert answer(never, Role.OPERATOR, "websocket", origin="http://evil.example")[0]["type"] == "websocket.close"


def test_a_token_is_new_each_time():
    assert len({access.new_tokens() for _ in range(8)}) == 8
