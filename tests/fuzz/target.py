"""Fuzz one kind of input for a while: `python -m tests.fuzz.target --seconds 60 --kind scene`.

Inputs of the corpus are changed at random, bytes and words, and joined; what breaks is written into the corpus, where the tests
replay it. The same seed gives the same inputs. Exit status 1 if anything broke.
"""

from __future__ import annotations

import argparse
import hashlib
import random
import resource
import sys
import time
import traceback
from collections import Counter

from tests.fuzz.kinds import CORPUS, KINDS, TooSlowError, check, corpus

MEMORY = 3_000_000_000  # bytes of this process
LONGEST = 20_000  # bytes of an input
RAW = (b"\xff\xfe", b"\x00", b"\xc2\xb2", b"\r\n", b"\xef\xbb\xbf", b"\xf0\x9f\x98\x80")
WORDS = (
    *RAW,
    *b"nan inf -inf 1e999 -1 0 1e-320 1e308 99999999999999999999 0x7f 1_000 1e5 true false [] {} [[]] {a=1} ''".split(),
    *b"[[[[[[[[ a.a.a.a.a.a=1 1979-05-27 07:32:00 # = , ; - -- ../../etc/passwd /dev/zero needle.vtu [time]".split(),
    *b"thesis brachytherapy --set --strict --out --force tissue.layers.0.damping= loads.9.force=1".split(),
    *b"Int32 Float64 $Nodes $Elements -2147483648 18446744073709551616".split(),
    *br"""
"1 mm"
"1 mm^9"
'1 m/s/s'
"1 mm^99999999"
"\u0000"
time [s]
speed [mm/s]
{ file = "speed.csv", column = "speed" }
{ mean = 1, amplitude = 1e300, frequency = 1e300 }
{ time = [0, 1], value = [0, 1e308] }
needle.length=1 mm
NumberOfPoints="-1"
NumberOfComponents="99999999999"
format="binary"
<!ENTITY a "b">
""".strip().splitlines(),
)


def changed(content: bytes, others: list[bytes], chance: random.Random) -> bytes:
    """Return an input after one to eight random changes."""
    for _ in range(chance.choice((1, 1, 2, 3, 8))):
        content = chance.choice(CHANGES)(content, others, chance)[:LONGEST]
    return content


def _places(content: bytes, chance: random.Random) -> tuple[int, int]:
    first = chance.randint(0, len(content))
    return first, min(len(content), first + chance.choice((0, 1, 4, 16, 100, 1000)))


def _flip(content, others, chance):
    first, _ = _places(content, chance)
    return content[:first] + bytes([chance.randrange(256)]) + content[first + 1 :]


def _cut(content, others, chance):
    first, last = _places(content, chance)
    return content[:first] + content[last:]


def _repeat(content, others, chance):
    first, last = _places(content, chance)
    return content[:first] + content[first:last] * chance.choice((2, 3, 50)) + content[last:]


def _word(content, others, chance):
    first, last = _places(content, chance)
    return content[:first] + chance.choice(WORDS) + content[min(last, first + 4) :]


def _token(content, others, chance):
    """Replace a whole word: what most often is still a scene."""
    words = content.split(b" ")
    words[chance.randrange(len(words))] = chance.choice(WORDS)
    return b" ".join(words)


def _line(content, others, chance):
    lines = content.split(b"\n")
    other = chance.choice(others).split(b"\n")
    lines.insert(chance.randint(0, len(lines)), chance.choice(other))
    return b"\n".join(lines)


def _join(content, others, chance):
    other = chance.choice(others)
    return content[: _places(content, chance)[0]] + other[_places(other, chance)[0] :]


CHANGES = (_flip, _cut, _repeat, _word, _token, _token, _line, _join)


def broken(kind: str, content: bytes) -> str | None:
    """Return what is wrong with the answer to an input, and where; None if nothing is."""
    try:
        check(kind, content)
    except (Exception, TooSlowError, KeyboardInterrupt) as error:
        if isinstance(error, KeyboardInterrupt):
            raise
        place = traceback.extract_tb(error.__traceback__)[-1]
        return f"{type(error).__name__}: {str(error)[:200]} at {place.name}, line {place.lineno}"
    return None


def fuzz(kind: str, seconds: float, seed: int) -> Counter[str]:
    """Try inputs of a kind and return how often what broke; one input of each is kept."""
    chance, known = random.Random(f"{kind} {seed}"), [path.read_bytes() for path in corpus(kind)]
    found: Counter[str] = Counter()
    count, end = 0, time.monotonic() + seconds
    while time.monotonic() < end:
        content = changed(chance.choice(known), known, chance)
        problem = broken(kind, content)
        count += 1
        if problem is not None:
            place = problem.rpartition(" at ")[2] + problem.partition(":")[0]
            found[place] += 1
            if found[place] == 1:
                name = hashlib.sha256(content).hexdigest()[:12]
                (CORPUS / kind / f"found-{name}").write_bytes(content)
                print(f"{kind}: found-{name}: {problem}", flush=True)
    print(f"{kind}: {count} inputs, {len(found)} different failures", flush=True)
    return found


def main() -> int:
    """Fuzz as the command line says."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seconds", type=float, default=60.0, help="for all kinds together")
    parser.add_argument("--kind", choices=sorted(KINDS), help="default: all in turn")
    parser.add_argument("--seed", type=int, default=0)
    asked = parser.parse_args()
    resource.setrlimit(resource.RLIMIT_AS, (MEMORY, MEMORY))
    kinds = [asked.kind] if asked.kind else list(KINDS)
    return int(sum(len(fuzz(kind, asked.seconds / len(kinds), asked.seed)) for kind in kinds) > 0)


if __name__ == "__main__":
    sys.exit(main())
