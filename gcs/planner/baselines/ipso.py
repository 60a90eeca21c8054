"""IPSO: a particle swarm whose parameters change with time, from exploration to exploitation.

Y. Shi, R. Eberhart: Empirical study of particle swarm optimization. Proc. Congress on Evolutionary Computation, 1999,
1945-1950 (inertia that falls linearly).
A. Ratnaweera, S. Halgamuge, H. Watson: Self-organizing hierarchical particle swarm optimizer with time-varying
acceleration coefficients. IEEE Trans. Evolutionary Computation 8(3), 2004, 240-255 (learning factors likewise).

The paper names an "improved PSO with parameter changes" and no rule for them. Ranges of inertia and learning factors
are those of its section 3.1.1. (Its own adaptive rules, without population and topology, are a row of the ablation.)
"""

from gcs.planner.baselines.pso import Pso, Pull

INERTIA = (0.9, 0.4)
"""At the beginning and at the end."""
OWN_LEARNING = (3.5, 0.5)
SOCIAL_LEARNING = (0.5, 3.5)


class Ipso(Pso):
    """The traditional swarm with parameters that change linearly over the whole search."""

    def pull(self, share_done: float) -> Pull:
        """Parameters after this share of the search."""

        def between(begin_end: tuple[float, float]) -> float:
            return begin_end[0] + share_done * (begin_end[1] - begin_end[0])

        return Pull(between(INERTIA), between(OWN_LEARNING), between(SOCIAL_LEARNING))
