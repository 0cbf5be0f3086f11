# ---
# jupyter:
#   jupytext:
#     formats: ipynb,py:percent
#     text_representation:
#       extension: .py
#       format_name: percent
#   kernelspec:
#     display_name: Python 3
#     language: python
#     name: python3
# ---

# %% [markdown]
# # 04 Identification
#
# From measured data to numbers with intervals: what the data say, and what they cannot say. Formulas and sources: `docs/identification.md`.

# %%
# %matplotlib inline
import matplotlib.pyplot as plt
import numpy as np

from fem_needle import SceneError, identify, load_scene, read_measurements
from fem_needle.identification import identify_friction, needle_mass, repeat_friction_experiment, sample_path

# %% [markdown]
# ## Two moduli from tips
#
# A sample that ships with the package: tips at 20 depths, with 2 micrometers of noise, of a needle in two layers, 4 and 30 kN/m^2. The scene starts from 5 and
# 20. Equilibria are computed with their exact sensitivities, so the fit takes milliseconds. The last quarter of the rows is predicted, not fitted.

# %%
scene = load_scene("brachytherapy").with_value("numerics.analysis", "static")
tips = read_measurements(sample_path("brachytherapy-tips"))
moduli = ["tissue.layers.fat and muscle.foundation_modulus", "tissue.layers.prostate region.foundation_modulus"]
found = identify(scene, moduli, tips, held_back=0.25)
for one in found.parameters:
    low, high = one.interval
    print(f"{one.path}: {1e-3 * one.value:.2f} kN/m^2, 95 % interval {1e-3 * low:.2f} to {1e-3 * high:.2f}")
print(f"correlation {found.correlation[0, 1]:.2f}, condition {found.condition:.0f}, whiteness p = {found.whiteness.p_value:.2f}")
print(f"{found.prediction.rows} rows held back: {100 * found.prediction.inside:.0f} % inside the 95 % band")

# %%
figure, (above, below) = plt.subplots(2, 1, sharex=True, height_ratios=(2, 1), layout="constrained")
depths = 1e3 * tips["depth"][: len(found.measured)]
above.plot(depths, 1e3 * found.measured, "o", label="measured")
above.plot(depths, 1e3 * found.fitted, label="fitted")
above.set_ylabel("tip [mm]")
above.legend()
below.axhline(0.0, color="black", linewidth=0.8)
below.plot(depths, 1e6 * found.residuals, "o")
below.set(xlabel="depth [mm]", ylabel="residual [micrometers]")
plt.show()

# %% [markdown]
# ## What data cannot tell
#
# Where the hub is moved sideways and no force is known, only the modulus over the bending stiffness enters: a fit of both has no answer, and says so.

# %%
moved = scene.with_values(
    {
        "support": {"kind": "hub", "hub_deflection": 1e-3},
        "needle": {"length": 0.2, "bending_stiffness": 0.0157, "mass_per_length": 0.004},
        "tissue.layers": [{"foundation_modulus": 5e3}],
        "loads": [],
    }
)
both = ["needle.bending_stiffness", "tissue.layers.0.foundation_modulus"]
refused = ""
try:
    identify(moved, both, tips)
except SceneError as error:
    refused = str(error)
print(refused)

# %% [markdown]
# ## A model that is too small
#
# The same tips fitted by two modes: the values go where they make up for what the model lacks, and the intervals know nothing of that. What tells is the
# residual, which is larger than the noise of the camera.

# %%
small = identify(scene, moduli, tips, model="assumed-modes")
whole = identify(scene, moduli, tips)
for name, one in (("finite elements", whole), ("two modes", small)):
    values = ", ".join(f"{1e-3 * parameter.value:.1f}" for parameter in one.parameters)
    print(f"{name}: {values} kN/m^2, residuals of {1e6 * one.linear.deviation:.1f} micrometers")

# %% [markdown]
# ## Friction from a rising push
#
# A push rises until the needle slides. Samples are told apart by their speed: what sticks gives a threshold, what slides a line, f - m dv/dt = mu_s + mu_v v.

# %%
record = read_measurements(sample_path("friction"))
ramp = load_scene("friction-ramp")
fit = identify_friction(record["time"], record["depth"], record["push_force"], mass=needle_mass(ramp))
print(f"mu_s {fit.coulomb.value:.3f} N, 95 % interval {fit.coulomb.interval()[0]:.3f} to {fit.coulomb.interval()[1]:.3f}")
print(f"mu_v {fit.viscous.value:.3f} N s/m, 95 % interval {fit.viscous.interval()[0]:.3f} to {fit.viscous.interval()[1]:.3f}")

# %%
figure, axes = plt.subplots(layout="constrained")
for mask, name in ((fit.samples.sticking, "sticking"), (fit.samples.sliding, "sliding")):
    axes.plot(record["time"][mask], record["push_force"][mask], ".", markersize=3, label=name)
axes.set(xlabel="time [s]", ylabel="push [N]")
axes.legend()
plt.show()

# %% [markdown]
# Twenty needles whose friction differs as in the thesis' Table I (0.56 +- 0.037 N, 0.3 +- 0.045 N s/m); five here.

# %%
repeated = repeat_friction_experiment(ramp, 5, deviations=(0.0374, 0.0447), seed=1)
print(f"mu_s errors {1e3 * np.sqrt(np.mean(repeated.errors[:, 0] ** 2)):.1f} mN rms")
print(f"mu_v errors {np.sqrt(np.mean(repeated.errors[:, 1] ** 2)):.3f} N s/m rms")

# %% [markdown]
# ## Checked

# %%
intervals = [one.interval for one in whole.parameters]
assert intervals[0][0] < 4e3 < intervals[0][1] and intervals[1][0] < 3e4 < intervals[1][1]
assert found.prediction.inside >= 0.8
assert "apart" in refused
assert small.linear.deviation > 2.0 * whole.linear.deviation
assert np.max(np.abs(repeated.errors[:, 0])) < 0.02
