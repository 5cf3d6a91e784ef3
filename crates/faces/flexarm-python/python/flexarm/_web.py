"""The web page of the program, served on this machine."""

from __future__ import annotations

import threading
from functools import partial
from pathlib import Path
from typing import Any

_PAGE = Path(__file__).parent / "share/web"


class WebPage:
    """The page on which the program runs as WebAssembly, served until it is closed.

    In a notebook, the page is shown in a frame.

    Attributes
    ----------
    url : str
        Address of the page, on the loopback interface of this machine.
    """

    def __init__(self, port: int = 0, height: int = 800) -> None:
        if not (_PAGE / "flexarm.wasm").is_file():
            raise FileNotFoundError(
                f"this installation has no web page: no {_PAGE / 'flexarm.wasm'}; run tools/build_web.py in the "
                "sources and then tools/build_wheel.py, which includes the page"
            )
        # Imported here, because few processes serve the page.
        from http.server import SimpleHTTPRequestHandler, ThreadingHTTPServer

        class Files(SimpleHTTPRequestHandler):
            def log_message(self, format: str, *args: Any) -> None:
                pass

        class Server(ThreadingHTTPServer):
            def handle_error(self, request: Any, client_address: Any) -> None:
                pass  # the browser has closed the connection

        self._height = height
        self._server = Server(("127.0.0.1", port), partial(Files, directory=str(_PAGE)))
        self.url = f"http://127.0.0.1:{self._server.server_port}/"
        threading.Thread(target=self._server.serve_forever, name="flexarm.web", daemon=True).start()

    def close(self) -> None:
        """Stop the server."""
        self._server.shutdown()
        self._server.server_close()

    def __enter__(self) -> "WebPage":
        return self

    def __exit__(self, *_: Any) -> None:
        self.close()

    def __repr__(self) -> str:
        return f"<WebPage {self.url}>"

    def _repr_html_(self) -> str:
        return f'<iframe src="{self.url}" title="flexarm" style="width: 100%; height: {self._height}px; border: 0"></iframe>'


def web(*, port: int = 0, height: int = 800) -> WebPage:
    """Serve the web page of the program on this machine: a frame in a notebook, an address elsewhere.

    Parameters
    ----------
    port : int
        Port on the loopback interface; 0 takes a free one.
    height : int
        Height of the frame in a notebook, in pixels.

    Returns
    -------
    WebPage
        The page; the server ends with the process or with ``close()``.

    Raises
    ------
    FileNotFoundError
        If the page was not built into this installation.

    Examples
    --------
    >>> page = flexarm.web()          # doctest: +SKIP
    >>> webbrowser.open(page.url)     # doctest: +SKIP
    """
    return WebPage(port, height)
