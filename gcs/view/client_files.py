"""What a browser loads: viser's own client, taken apart into files that the browser can keep.

viser ships its client as one page, compressed within itself: a browser unpacks, parses and compiles 2.5 MB of script at
every reload. As files with names of their contents they are kept, compiled. And a scene of viser begins with lights,
shadows and a sky of its own, which this page takes away with its first messages; a browser without a graphics card has
begun by then to work them out, which takes it several seconds. Here the client begins without them.
"""

import gzip
import hashlib
import re
from dataclasses import dataclass
from functools import cache
from importlib.resources import files

import numpy as np
import zstandard

KEPT = "max-age=31536000, immutable"
ALPHABET = "".join(chr(code) for code in range(0x21, 0x7F) if chr(code) not in "\"&<>'`")
"""Of viser's base 88: five characters are four bytes, the first ones the highest."""
LOADER = re.compile(r'<script data-p="([^"]*)" data-ss="(\d+)" data-cs="(\d+)">(.*?)</script>', re.DOTALL)
DECODER = re.compile(r'const gzWasm="((?:[^"\\]|\\.)*)"')
LIT = "enableDefaultLights:!0,enableDefaultLightsShadows:!0,environmentMap:null"
UNLIT = (
    "enableDefaultLights:!1,enableDefaultLightsShadows:!1,environmentMap:{type:`EnvironmentMapMessage`,hdri_data:null}"
)
"""The scene of a client to which no server has said anything."""
CHECKED, UNCHECKED = b"checkShaderErrors:!0", b"checkShaderErrors:!1"
"""Reading each shader's log, which has nothing to tell once a viewer is built, waits until it is compiled."""
RESTYLING = re.compile(rb"[^{}]*:has\(\[[^{}]*\{[^{}]*\}")
"""Rules for details of widgets that no page of ours has. With one of them a browser works out the styles of everything
on the page again whenever anything is added to it: see the head of page.css."""
START = (
    '<link rel="modulepreload" href="/{script}"><link rel="stylesheet" href="/{style}"><script type="module">'
    'globalThis.__viserZstdWasm=await WebAssembly.compileStreaming(fetch("/{decoder}"));await import("/{script}")'
    "</script>"
)


class UnknownClientError(Exception):
    """The page of this version of viser is not made as we know it."""


@dataclass(frozen=True)
class ClientFile:
    """One file: its media type, how long it may be kept, and its contents, compressed by gzip."""

    media_type: str
    caching: str
    packed: bytes

    @property
    def headers(self) -> dict[str, str]:
        """For an answer that consists of it."""
        return {
            "Content-Type": self.media_type,
            "Content-Length": str(len(self.packed)),
            "Content-Encoding": "gzip",
            "Cache-Control": self.caching,
        }


@cache
def client_files() -> dict[str, ClientFile]:
    """The files of the installed viser, by path.

    Raises:
        UnknownClientError: naming what was not found.
    """
    return taken_apart((files("viser") / "client" / "build" / "index.html").read_text(encoding="utf-8"))


def taken_apart(page: str) -> dict[str, ClientFile]:
    """The files that make up a page of viser, by path.

    Raises:
        UnknownClientError: naming what was not found.
    """
    loader = LOADER.search(page)
    if loader is None:
        raise UnknownClientError("no compressed client in its page")
    decoder = DECODER.search(loader[4])
    if decoder is None:
        raise UnknownClientError("no decoder beside the client")
    style_size, script_size = int(loader[2]), int(loader[3])
    both = zstandard.ZstdDecompressor().decompress(from_base_88(loader[1]), max_output_size=style_size + script_size)
    script = both[style_size:]
    if script.count(LIT.encode()) != 1:
        raise UnknownClientError(f"not one but {script.count(LIT.encode())} places that set the lights")
    unlit = script.replace(LIT.encode(), UNLIT.encode()).replace(CHECKED, UNCHECKED)
    kept = {
        "style": _kept("client", "css", "text/css; charset=utf-8", RESTYLING.sub(b"", both[:style_size])),
        "script": _kept("client", "js", "text/javascript; charset=utf-8", unlit),
        "decoder": _kept("decoder", "wasm", "application/wasm", gzip.decompress(_unquoted(decoder[1]))),
    }
    start = START.format(**{part: path for part, (path, _) in kept.items()})
    index = page[: loader.start()] + start + page[loader.end() :]
    whole = ClientFile("text/html; charset=utf-8", "no-cache", gzip.compress(index.encode()))
    return {"": whole, "index.html": whole} | dict(kept.values())


def from_base_88(text: str) -> bytes:
    """The bytes behind a text in viser's base 88; of a last group of k characters, k - 1 bytes."""
    values = np.full(128, -1, dtype=np.int64)
    values[[ord(character) for character in ALPHABET]] = np.arange(len(ALPHABET))
    digits = values[np.frombuffer(text.encode("ascii"), dtype=np.uint8)]
    if (digits < 0).any():
        raise UnknownClientError("a character that base 88 does not have")
    whole = digits[: len(digits) // 5 * 5].reshape(-1, 5) @ (len(ALPHABET) ** np.arange(4, -1, -1))
    rest = 0
    for digit in digits[len(digits) // 5 * 5 :].tolist():
        rest = rest * len(ALPHABET) + digit
    return whole.astype(">u4").tobytes() + rest.to_bytes(max(len(digits) % 5 - 1, 0), "big")


def _kept(stem: str, suffix: str, media_type: str, contents: bytes) -> tuple[str, ClientFile]:
    """A file whose name tells its contents, so that it may be kept for ever."""
    name = f"{stem}-{hashlib.sha256(contents).hexdigest()[:16]}.{suffix}"
    return name, ClientFile(media_type, KEPT, gzip.compress(contents, compresslevel=4))


def _unquoted(literal: str) -> bytes:
    """The bytes of a base-88 text that stands in a script."""
    return from_base_88(re.sub(r"\\(.)", r"\1", literal))
