"""Puts the page, its style, its scripts and the planner into one file: bundle.py PLANNER.wasm PAGE.html."""

import base64
import gzip
import hashlib
import re
import sys
from pathlib import Path

PAGE = Path(__file__).parent / "page"
# Scripts that the report of evaluations has, too.
SHARED = Path(__file__).parent.parent / "src" / "output" / "page"


def inside(name: str) -> str:
    """A file of the page that stands well within an element."""
    folder = PAGE if (PAGE / name).exists() else SHARED
    text = (folder / name).read_text(encoding="utf-8")
    assert "</script" not in text and "</style" not in text, name
    return f"\n{text}"


def hashed(text: str) -> str:
    """What a content security policy calls this text."""
    digest = hashlib.sha256(text.encode()).digest()
    return f"'sha256-{base64.b64encode(digest).decode()}'"


def bundle(planner: bytes) -> str:
    page = (PAGE / "index.html").read_text(encoding="utf-8")
    allowed = []

    def script(match: re.Match) -> str:
        text = inside(match[1])
        allowed.append(hashed(text))
        return f"<script>{text}</script>"

    style = inside("style.css")
    page = page.replace('<link rel="stylesheet" href="style.css">', f"<style>{style}</style>")
    page = re.sub(r'<script src="([a-z]+\.js)"></script>', script, page)
    # The same bytes for the same planner: no time of day in the packed data.
    packed = base64.b64encode(gzip.compress(planner, 9, mtime=0)).decode()
    data = (
        f'<script type="text/plain" id="worker-inside">{inside("worker.js")}</script>\n'
        f'<script type="text/plain" id="planner-inside">{packed}</script>\n'
    )
    page = page.replace("<script>", data + "<script>", 1)
    policy = "; ".join([
        "default-src 'none'",
        # The worker inherits this: it makes the planner ready.
        f"script-src {' '.join(allowed)} 'wasm-unsafe-eval' blob:",
        "worker-src blob:",
        f"style-src {hashed(style)}",
        "img-src data:",
        "base-uri 'none'",
        "form-action 'none'",
    ])
    meta = f'<meta http-equiv="Content-Security-Policy" content="{policy}">\n'
    return page.replace("<title>", meta + "<title>", 1)


def main() -> None:
    planner, out = map(Path, sys.argv[1:])
    text = bundle(planner.read_bytes())
    out.write_text(text, encoding="utf-8")
    size = planner.stat().st_size
    print(f"{out}: {len(text) / 1e6:.1f} MB, with a planner of {size / 1e6:.1f} MB")


main()
