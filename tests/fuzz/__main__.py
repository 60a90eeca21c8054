"""Hostile traffic on all receive paths for a while; the exit code is not 0 if anything gets out of one.

A finding names its target, seed and round: `--seed N --only TARGET` finds it again.
"""

import argparse
import sys
import time
import traceback

import numpy as np

from tests.fuzz.targets import TARGETS

CHECK_EVERY = 20


def main() -> int:
    """0 if nothing was found."""
    parser = argparse.ArgumentParser(prog="python -m tests.fuzz", description=__doc__)
    parser.add_argument("--seconds", type=float, default=60.0)
    parser.add_argument("--seed", type=int, default=None, help="a new one each time if not given")
    parser.add_argument("--only", choices=tuple(TARGETS), help="one target alone")
    given = parser.parse_args()
    seed = given.seed if given.seed is not None else int(np.random.SeedSequence().generate_state(1)[0])
    chosen = [given.only] if given.only else list(TARGETS)
    return sum(fuzz(name, seed, given.seconds / len(chosen)) for name in chosen) > 0


def fuzz(name: str, seed: int, seconds: float) -> int:
    """Feed one target; how many findings (it stops at the first)."""
    target = TARGETS[name](np.random.default_rng(seed))
    end_s, rounds = time.monotonic() + seconds, 0
    try:
        while time.monotonic() < end_s:
            target.feed()
            rounds += 1
            if rounds % CHECK_EVERY == 0:
                target.check()
        target.check()
    except Exception:
        traceback.print_exc()
        print(f"{name}: found something in round {rounds} with --seed {seed}", flush=True)
        return 1
    finally:
        target.close()
    print(f"{name}: {rounds} rounds, nothing found (--seed {seed})", flush=True)
    return 0


if __name__ == "__main__":
    sys.exit(main())
