"""The filter against a float64 one, its consistency on random walks, and nasty sightings."""

import jax
import jax.numpy as jnp
import numpy as np
from scipy import stats

from jaxbiped.arenas.arena import Landmarks
from jaxbiped.geometry.pose import Pose
from jaxbiped.localisation import Belief, correct, known, predict
from jaxbiped.sensing import OdometryConfig, Sightings, counter_rng, drift
from tests.reference import sensing as reference
from tests.sensing.scenes import as_numpy

LANDMARKS = Landmarks(
    x=jnp.array([0.5, 1.5, 1.0, 0.2, jnp.nan]),
    y=jnp.array([0.2, 0.4, 1.3, 1.0, jnp.nan]),
    yaw=jnp.zeros(5),
    kind=jnp.zeros(5, jnp.int32),
    used=jnp.array([True, True, True, True, False]),
)
SD = 0.01
NOISE = OdometryConfig(yaw_walked=5, forward=0.02, lateral=0.02).traced()


def truth_step(pose, step):
    c, s = jnp.cos(pose[2]), jnp.sin(pose[2])
    return jnp.stack([pose[0] + c * step[0] - s * step[1], pose[1] + s * step[0] + c * step[1], pose[2] + step[2]])


def look(pose, seed, seen, sd=SD):
    """Sightings from a true pose."""
    c, s = jnp.cos(pose[2]), jnp.sin(pose[2])
    dx, dy = LANDMARKS.x - pose[0], LANDMARKS.y - pose[1]
    error = sd * counter_rng.normal(seed, np.arange(10), 9).reshape(2, 5)
    return Sightings(c * dx + s * dy + error[0], -s * dx + c * dy + error[1], jnp.full(5, sd), seen)


def walk(seed, steps=30):
    """Normalised squared errors of a robot that walks in a circle and sees each landmark one time in three."""

    def step(state, k):
        true, belief = state
        now = counter_rng.fold(seed, k)
        asked = (jnp.float32(0.05), jnp.float32(0), jnp.float32(0.2))
        moved, variances = drift(asked, NOISE, now)
        true = truth_step(true, jnp.stack(moved))
        belief = predict(belief, *asked, variances)
        sightings = look(true, now, counter_rng.uniform(now, np.arange(5), 8) < 1 / 3)
        belief = correct(belief, LANDMARKS, sightings)
        pose = belief.pose
        error = jnp.stack([pose.x, pose.y, pose.yaw]) - true
        error = error.at[2].set(jnp.mod(error[2] + jnp.pi, 2 * jnp.pi) - jnp.pi)
        return (true, belief), (error @ jnp.linalg.solve(belief.cov, error), belief, moved, variances, sightings)

    start = known(Pose(*jnp.array([0.8, 0.5, 0.03, 0.0])))
    start = Belief(start.pose, jnp.diag(jnp.array([1e-4, 1e-4, 1e-3])))
    spread = jnp.sqrt(jnp.diag(start.cov)) * counter_rng.normal(seed, np.arange(3), 10)
    return jax.lax.scan(step, (jnp.array([0.8, 0.5, 0.0]) + spread, start), jnp.arange(steps))[1]


walks = jax.jit(jax.vmap(walk))


def test_agrees_with_a_float64_filter():
    """30 steps of predicting and correcting in float32 stay within 1e-5 m of float64, covariances within 1 %."""
    _, beliefs, _, variances, sightings = as_numpy(walks(jnp.arange(8, dtype=jnp.uint32)))
    marks = as_numpy(LANDMARKS)
    for b in range(8):
        belief = Belief(Pose(0.8, 0.5, 0.03, 0.0), np.diag([1e-4, 1e-4, 1e-3]))
        for k in range(30):
            belief = reference.predict(belief, 0.05, 0.0, 0.2, variances[b, k])
            belief = reference.correct(belief, marks, jax.tree.map(lambda leaf: leaf[b, k], sightings))  # noqa: B023
            for name in ("x", "y", "z", "yaw"):
                assert abs(getattr(beliefs.pose, name)[b, k] - getattr(belief.pose, name)) < 1e-5
            assert np.allclose(beliefs.cov[b, k], belief.cov, rtol=0.01, atol=1e-8)


def test_errors_are_as_large_as_claimed():
    """Normalised squared errors of 1,000 walks at their end are chi-squared with three degrees of freedom."""
    nees = np.asarray(walks(jnp.arange(1000, dtype=jnp.uint32))[0])
    last = nees[:, -1]
    assert abs(last.mean() - 3) < 0.35  # four standard errors and a little for linearising
    assert abs((last < stats.chi2.ppf(0.95, 3)).mean() - 0.95) < 0.028  # four standard errors


def prior(yaw=0.3):
    return Belief(Pose(*jnp.array([0.8, 0.5, 0.0, yaw])), jnp.diag(jnp.array([1e-2, 1e-2, 1e-1])))


corrected = jax.jit(correct)


def test_two_landmarks_fix_the_pose_and_one_still_helps():
    true = jnp.array([0.85, 0.45, 0.4])
    seen = lambda *slots: look(true, jnp.uint32(1), jnp.isin(jnp.arange(5), jnp.array(slots)), sd=0.001)  # noqa: E731
    two = corrected(prior(), LANDMARKS, seen(0, 1))
    assert np.allclose([two.pose.x, two.pose.y, two.pose.yaw], true, atol=0.01)
    one = corrected(prior(), LANDMARKS, seen(1))
    before, after = np.linalg.eigvalsh(prior().cov), np.linalg.eigvalsh(one.cov)
    assert after[0] < 0.01 * before[0] and np.linalg.det(one.cov) < 1e-3 * np.linalg.det(prior().cov)


def test_outliers_are_refused():
    belief = Belief(prior().pose, prior().cov * 1e-3)
    sightings = look(jnp.array([0.8, 0.5, 0.3]), jnp.uint32(1), jnp.arange(5) == 0)
    wrong = Sightings(sightings.x + 0.5, sightings.y, sightings.sd, sightings.seen)
    same = corrected(belief, LANDMARKS, wrong)
    assert all(np.array_equal(a, b) for a, b in zip(jax.tree.leaves(same), jax.tree.leaves(belief), strict=True))


def test_nasty_sightings_leave_it_finite():
    good = look(jnp.array([0.8, 0.5, 0.3]), jnp.uint32(1), jnp.ones(5, bool))  # slot 4 is unused and NaN
    for bad in (jnp.nan, jnp.inf, 1e30):
        for name in ("x", "sd"):
            sightings = Sightings(**{**vars(good), name: getattr(good, name).at[1].set(bad)})
            for leaf in jax.tree.leaves(corrected(prior(), LANDMARKS, sightings)):
                assert np.all(np.isfinite(leaf))
    belief = known(Pose(*jnp.array([0.8, 0.5, 0.0, 0.3])))
    for _ in range(3):  # nothing to learn: no variance, and sightings without any
        belief = corrected(
            belief, LANDMARKS, look(jnp.array([0.8, 0.5, 0.3]), jnp.uint32(1), jnp.ones(5, bool), sd=0.0)
        )
    assert all(np.all(np.isfinite(leaf)) for leaf in jax.tree.leaves(belief))


def test_yaw_stays_wrapped_and_covariance_positive():
    belief = prior(yaw=3.1)
    for k in range(50):
        belief = predict(belief, jnp.float32(0.05), jnp.float32(0), jnp.float32(0.3), jnp.full(3, 1e-4))
        true = jnp.stack([belief.pose.x, belief.pose.y, belief.pose.yaw])
        belief = corrected(belief, LANDMARKS, look(true, jnp.uint32(k), jnp.ones(5, bool)))
        assert -np.pi < belief.pose.yaw <= np.pi
        assert np.linalg.eigvalsh(np.asarray(belief.cov, float)).min() > 0
