"""How clearly a hidden effect shows: what it changes in the positions, in standard deviations of what hides it.

The difference between the noise-free runs with the effect and without it is compared with everything by which it could be
explained away: camera noise, friction that scatters from cycle to cycle, the places of the cells, and the recalibration of
friction, stiffness, stroke, slope and clock within priors. What recalibration does to the positions is taken from a
quasi-static worm, a spring in series with a slider for each cell. With f(x) what all that does to the positions, x in units of
the priors, and r the difference, both in standard deviations of the noise, the figure is the root of the least |r - f(x)|² + |x|².
"""

import numpy as np

from worm import GRAVITY, Worm, rounded_ramp

# Bins in each step of a cell.
BINS = 12
# Standard deviations of what is not known of a clean worm: of all cells together, and of each.
PRIORS = {"friction": (0.08, 0.02), "stiffness": (0.05, 0.02), "stroke": (0.01, 0.003)}
SLOPE_DEG = 0.3
CLOCK_S = 2e-3
PLACE_M = 0.01
# Change for the derivatives, in standard deviations of the priors.
SMALL = 0.05
# Steps of the recalibration at most, the fraction of what remains by which another must lower it, and halvings of a step.
STEPS, WORTH_A_STEP, STEP_HALVINGS = 8, 1e-3, 6


def balancing_shift(k: np.ndarray, bound: np.ndarray, trial: np.ndarray, weight: np.ndarray) -> np.ndarray:
    """The body's shift [variant] at which the tips, deformed by `trial` [variant, cell] without it, hold the weight.

    Their force rises with the shift in straight lines, which bend where a tip begins or ends to slide: so between two bends.
    """
    bends = np.sort(np.concatenate([-bound - trial, bound - trial], axis=1), axis=1)
    deformation = np.clip(trial[:, None] + bends[:, :, None], -bound[:, None], bound[:, None])
    force = (k[:, None] * deformation).sum(axis=2) + weight[:, None]
    after = np.clip((force < 0.0).sum(axis=1), 1, bends.shape[1] - 1)
    variant = np.arange(len(bends))
    low, high = force[variant, after - 1], force[variant, after]
    fraction = np.clip(-low / np.maximum(high - low, 1e-300), 0.0, 1.0)
    return bends[variant, after - 1] + fraction * (bends[variant, after] - bends[variant, after - 1])


def quasi_static(worm: Worm, slope_deg: np.ndarray, phase: np.ndarray, factors: dict) -> np.ndarray:
    """Positions [variant, phase, cell] of several variants at once, laid down at the first phase.

    Exact where the phases hold every end of a step: forces are in balance at each, and deformations clipped at their bound.

    `factors` has arrays [variant, cell] for "friction", "stiffness" and "stroke"; `slope_deg` is [variant].
    """
    n = worm.cells
    friction = worm.friction_n * factors["friction"]
    k = worm.stiffness_n_per_m * factors["stiffness"]
    stroke = worm.stroke_m * factors["stroke"]
    weight = worm.mass_kg * GRAVITY * np.sin(np.radians(slope_deg))
    bound = friction / k
    unit = np.empty((len(phase), n))
    for place, cell in enumerate(worm.step_order):
        since = phase * n - place
        cycle = np.floor(since / n)
        unit[:, cell] = cycle + rounded_ramp(np.clip(since - cycle * n, 0.0, 1.0), worm.rounding)
    deformation = np.broadcast_to(-(weight / k.sum(axis=1))[:, None], bound.shape).copy()
    position = np.zeros_like(bound)
    out = np.empty((len(bound), len(phase), n))
    for row in range(len(phase)):
        if row:
            step = stroke * (unit[row] - unit[row - 1])
            trial = deformation + step
            shift = balancing_shift(k, bound, trial, weight)
            deformation = np.clip(trial + shift[:, None], -bound, bound)
            position = position + step + shift[:, None]
        out[:, row] = position
    return out


class Detector:
    """What hides an effect in the runs of one campaign, ready to be compared with what the effect does."""

    def __init__(self, worm: Worm, runs: list, capture):
        """`runs` are (slope in degrees, first whole phase, cycles, cycle time in s)."""
        self.worm, self.runs = worm, runs
        n = worm.cells
        # What recalibration can do: all cells together, then each, of friction, stiffness and stroke; then the slope of each run.
        self.shared = len(PRIORS) * (n + 1)
        self.bent = self.shared + len(runs)
        neutral = np.zeros(self.bent)
        self.clean = [self._positions(neutral[None], run)[0] for run in range(len(runs))]
        self.noise = []
        for slope, first, cycles, cycle_s in runs:
            bin_s = cycle_s / (n * BINS)
            white = capture.noise_m**2 / max(capture.rate_hz * bin_s, 1.0)
            self.noise.append(np.sqrt(white + capture.drift_m**2 * 2.0 * capture.drift_s / bin_s))
        bent = self._columns(neutral)
        straight = []
        for run, (slope, first, cycles, cycle_s) in enumerate(runs):
            clean, noise = self.clean[run], self.noise[run]
            clock = np.gradient(clean, axis=0) * (n * BINS / cycle_s) * CLOCK_S
            # An advance of its own in each cycle, from the scatter of the friction.
            since = np.arange(len(clean)) // (n * BINS)
            scatter = worm.scatter * self._advance_by_friction(run)
            walk = [np.where(since >= c, scatter, 0.0)[:, None] * np.ones(n) for c in range(1, cycles)]
            places = [np.ones((len(since), 1)) * (np.arange(n) == cell) * PLACE_M for cell in range(n)]
            straight.append((clock / noise, np.stack([*walk, *places]) / noise))
        own = [len(columns) for _, columns in straight]
        self.matrix = np.zeros((len(bent), self.bent + 1 + sum(own)))
        self.matrix[:, : self.bent] = bent
        row, column = 0, self.bent + 1
        for (clock, columns), wide in zip(straight, own):
            count = clock.size
            self.matrix[row : row + count, self.bent] = clock.ravel()
            self.matrix[row : row + count, column : column + wide] = columns.reshape(wide, -1).T
            row, column = row + count, column + wide

    def _positions(self, recalibrations: np.ndarray, run: int) -> np.ndarray:
        """Positions [variant, phase, cell] of a run from its first whole cycle on, of worms recalibrated by so many priors each."""
        n = self.worm.cells
        slope, first, cycles, _ = self.runs[run]
        factors = {}
        for what, (name, (of_all, of_each)) in enumerate(PRIORS.items()):
            own = recalibrations[:, what * (n + 1) : (what + 1) * (n + 1)]
            factors[name] = np.exp(of_all * own[:, :1] + of_each * own[:, 1:])
        slopes = slope + SLOPE_DEG * recalibrations[:, self.shared + run]
        # One cycle of warm-up makes the crawl periodic. Every second row is the middle of a bin; those between are the bins' ends,
        # and with them the steps'.
        fine = np.arange(2 * (cycles + 1) * n * BINS) / (2 * n * BINS) + first - 1.0
        x = quasi_static(self.worm, slopes, fine, factors)[:, 1::2]
        warm = n * BINS
        return x[:, warm:] - x[:, warm - 1 : warm]

    def _columns(self, about: np.ndarray) -> np.ndarray:
        """What each recalibration changes about some values, in units of its prior and of the noise: a column each."""
        blocks = []
        for run, noise in enumerate(self.noise):
            mine = [*range(self.shared), self.shared + run]
            variants = np.repeat(about[None], len(mine) + 1, axis=0)
            for row, column in enumerate(mine):
                variants[row + 1, column] += SMALL
            x = self._positions(variants, run)
            block = np.zeros((x[0].size, self.bent))
            block[:, mine] = ((x[1:] - x[0]) / SMALL / noise).reshape(len(mine), -1).T
            blocks.append(block)
        return np.concatenate(blocks)

    def _advance_by_friction(self, run: int) -> float:
        """Standard deviation of a run's advance where the friction of every tip has its own factor, per relative deviation, m."""
        n = self.worm.cells
        variants = np.zeros((n + 1, self.bent))
        variants[1:, 1 : 1 + n] = SMALL * np.eye(n)
        x = self._positions(variants, run)[:, -1].mean(axis=1)
        return np.linalg.norm((x[1:] - x[0]) / (SMALL * PRIORS["friction"][1]) / self.runs[run][2])

    def _by_recalibration(self, recalibration: np.ndarray) -> np.ndarray:
        each = [
            ((self._positions(recalibration[None], run)[0] - self.clean[run]) / noise).ravel()
            for run, noise in enumerate(self.noise)
        ]
        return np.concatenate(each)

    @staticmethod
    def bins(first: float, cycles: int, cells: int) -> np.ndarray:
        """The phases at which a run is compared."""
        return np.arange(cycles * cells * BINS) / (cells * BINS) + first + 0.5 / (cells * BINS)

    def sigma(self, differences: list) -> float:
        """Standard deviations of a difference, [phase, cell] for each run, that nothing else explains."""
        difference = np.concatenate([(d / noise).ravel() for d, noise in zip(differences, self.noise)])
        matrix = self.matrix.copy()
        at = np.zeros(matrix.shape[1])
        remaining, square = difference, difference @ difference
        for step in range(STEPS):
            if step:
                matrix[:, : self.bent] = self._columns(at[: self.bent])
            normal = np.eye(matrix.shape[1]) + matrix.T @ matrix
            whole = np.linalg.solve(normal, matrix.T @ remaining - at)
            for halved in range(STEP_HALVINGS):
                there = at + whole * 0.5**halved
                recalibrated = self._by_recalibration(there[: self.bent])
                left = difference - recalibrated - self.matrix[:, self.bent :] @ there[self.bent :]
                here = left @ left + there @ there
                if here < square:
                    break
            else:
                break
            gain = square - here
            at, remaining, square = there, left, here
            if gain < WORTH_A_STEP * square:
                break
        return float(np.sqrt(square))
