"""The web page in the package: its server, and what a notebook shows of it."""

from urllib.error import HTTPError, URLError
from urllib.request import urlopen

import pytest
from conftest import SHARE

import flexarm
from flexarm import _web

PAGE = SHARE / "web"


def test_without_a_page_the_message_names_what_builds_it(monkeypatch, tmp_path):
    monkeypatch.setattr(_web, "_PAGE", tmp_path)
    with pytest.raises(FileNotFoundError, match="no web page.*build_web.py"):
        flexarm.web()


def test_files_are_served_on_the_loopback_interface_until_the_page_is_closed(monkeypatch, tmp_path):
    monkeypatch.setattr(_web, "_PAGE", tmp_path)
    (tmp_path / "flexarm.wasm").write_bytes(b"module")
    (tmp_path / "index.html").write_text("the page")
    with flexarm.web(height=300) as page:
        assert page.url.startswith("http://127.0.0.1:")
        assert f'src="{page.url}"' in page._repr_html_() and "300px" in page._repr_html_()
        assert urlopen(page.url).read() == b"the page"
        with urlopen(page.url + "flexarm.wasm") as module:
            assert (module.read(), module.headers["content-type"]) == (b"module", "application/wasm")
        with pytest.raises(HTTPError, match="404"):
            urlopen(page.url + "../__init__.py")
    with pytest.raises(URLError):
        urlopen(page.url)


@pytest.mark.skipif(not PAGE.is_dir(), reason="the wheel was built without the page of web/")
def test_the_page_of_the_package_has_the_program_and_its_robots():
    with flexarm.web() as page:
        assert urlopen(page.url + "flexarm.wasm").read(4) == b"\0asm"
        assert b"kr210" in urlopen(page.url + "shipped.json").read()
        assert urlopen(page.url + "shipped/robots/kr210/robot.toml").status == 200
