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
# # 05 Control
#
# A needle in a closed loop: images tell where its tip is, late and with noise; a controller decides; a robot's finger pushes from the side.
# For those who design the controller. What is measured, decided and commanded, with equations: `docs/control.md`.

# %%
# %matplotlib inline
from time import perf_counter

import matplotlib.pyplot as plt
import numpy as np
from scipy.signal import lfilter

from fem_needle import Simulation, analyze, build_plant, controller_of, load_scene, solve_static, steer
from fem_needle.closed_loop.repeating import repeat
from fem_needle.control.model_response import depth_range, model_response

# %% [markdown]
# ## A loop from a scene
#
# The scene `steering`: 100 mm at 10 mm/s, an image every 150 ms, a finger 10 mm before the skin. A bevel pushes the tip aside. `steer` runs the
# scene's own controller; with kind "none" nobody decides. Then the needle ends where its equilibrium at 100 mm is.

# %%
scene = load_scene("steering")
steered = steer(scene)
left_alone = steer(scene.with_value("controller.kind", "none"))
for name, run in (("controlled", steered), ("left alone", left_alone)):
    print(f"{name}: tip {1e3 * run.summary['target_error']:.2f} mm beside the target at 100 mm")
rest = solve_static(build_plant(scene), depth=0.1).tip_deflection
assert abs(left_alone.summary["target_error"] - rest) < 1e-3 * abs(rest)
assert abs(steered.summary["target_error"]) < 0.2 * abs(rest)

figure, (above, below) = plt.subplots(2, 1, figsize=(7, 5), sharex=True, layout="constrained")
above.plot(1e3 * left_alone.depth, 1e3 * left_alone.tip_deflection, "k--", label="left alone")
above.plot(1e3 * steered.depth, 1e3 * steered.tip_deflection, "C0", label="controlled")
above.plot(1e3 * steered.depth, 1e3 * steered.measurement_tip_deflection, "C0.", markersize=3, label="images")
above.plot(1e3 * scene.target.depth, 1e3 * scene.target.lateral, "kx", label="target")
above.set(ylabel="tip deflection [mm]")
above.legend()
below.step(1e3 * steered.depth, steered.command_lateral_force, "C0", where="post")
below.set(xlabel="depth [mm]", ylabel="finger [N]")
plt.show()

# %% [markdown]
# ## A controller of your own
#
# `Simulation.step` lets a command act for a while and returns what the sensors tell at its end: any controller can close the loop, here one that
# adds up. g is how far the tip moves at rest for one newton, at most: each image takes back a fifth of what it shows. With a constant drift per
# image the error left by such an integrator is the drift divided by that fifth (more where g is below its largest value).

# %%
plant = build_plant(scene)
gain = model_response(plant, "lateral_force", depths=depth_range(scene)).largest_gain
needle, force, seen = Simulation(plant), 0.0, {}

while needle.depth < scene.insertion.final_depth - 1e-9:
    force -= 0.2 * seen.get("tip_deflection", 0.0) / gain
    seen = needle.step({"lateral_force": force}, scene.controller.period)

print(f"one newton moves the tip by up to {1e3 * gain:.2f} mm")
print(f"tip {1e3 * needle.tip_deflection:.2f} mm, seen {1e3 * seen['tip_deflection']:.2f} mm, finger {force:.2f} N")
assert abs(needle.tip_deflection) < 0.2 * abs(rest)

# %% [markdown]
# ## What the plant is: its gain over the depth
#
# At rest the tip is linear in the force, tip = y0(z) + g(z) u. In `steering-stiff` g changes its sign on the way: deep in stiff tissue the needle
# turns about a point below the skin, and the tip goes against the finger. The same depth comes from the linear models of `analyze`.

# %%
stiff = load_scene("steering-stiff")
response = model_response(build_plant(stiff), "lateral_force", depths=depth_range(stiff))
[crossing] = response.sign_changes
[found] = [change.depth for change in analyze(stiff).curve.sign_changes if change.input == "lateral_force"]
print(f"the sign changes at {1e3 * crossing:.2f} mm, by linear models {1e3 * found:.2f} mm")
assert abs(crossing - found) < 1e-4

depths = np.linspace(response.first_depth, response.last_depth, 201)
figure, axes = plt.subplots(figsize=(7, 3.4), layout="constrained")
axes.plot(1e3 * depths, [1e3 * response.gain(depth) for depth in depths])
axes.axhline(0.0, color="gray", linewidth=0.8)
axes.axvline(1e3 * crossing, color="gray", linewidth=0.8, linestyle=":")
axes.set(xlabel="depth [mm]", ylabel="tip per force [mm/N]")
plt.show()

# %% [markdown]
# A PID with gains of fixed sign feeds back positively beyond that depth, and is worse than none. With `schedule = "model-gain"` its gains follow
# g at the measured depth, and so does its sign. What remains is what the finger's 3 N cannot do where g is small.

# %%
plain = steer(stiff.with_value("controller.schedule", "none"))
scheduled = steer(stiff)
nobody = steer(stiff.with_values({"controller": {"kind": "none"}}))
runs = {"no controller": (nobody, "k--"), "plain pid": (plain, "C1"), "scheduled pid": (scheduled, "C0")}

figure, (above, below) = plt.subplots(2, 1, figsize=(7, 5), sharex=True, layout="constrained")
for name, (run, line) in runs.items():
    print(f"{name}: {1e3 * run.summary['target_error']:.2f} mm at 120 mm")
    above.plot(1e3 * run.depth, 1e3 * run.tip_deflection, line, label=name)
    if name != "no controller":
        below.step(1e3 * run.depth, run.command_lateral_force, line, where="post")
for axes in (above, below):
    axes.axvline(1e3 * crossing, color="gray", linewidth=0.8, linestyle=":")
above.set(ylabel="tip deflection [mm]")
above.legend()
below.set(xlabel="depth [mm]", ylabel="finger [N]")
plt.show()
errors = {name: abs(run.summary["target_error"]) for name, (run, _) in runs.items()}
assert errors["scheduled pid"] < errors["no controller"] < errors["plain pid"]

# %% [markdown]
# ## The same controller on two modes
#
# A controller needs no model that is exact, and is often tried on a small one first. The same PID, with the gains that it takes from finite
# elements, steers the needle of finite elements and that of two assumed modes: alike where two modes hold, not deep in stiff tissue.

# %%
modal = build_plant(stiff.with_values({"model.kind": "assumed-modes", "model.modes": 2}))
on_modes = steer(stiff, plant=modal)
figure, axes = plt.subplots(figsize=(7, 3.4), layout="constrained")
axes.plot(1e3 * scheduled.depth, 1e3 * scheduled.tip_deflection, "C0", label="finite elements")
axes.plot(1e3 * on_modes.depth, 1e3 * on_modes.tip_deflection, "C1--", label="two modes")
axes.set(xlabel="depth [mm]", ylabel="tip deflection [mm]")
axes.legend()
plt.show()
on_both = [np.interp(depths, run.depth, run.tip_deflection) for run in (scheduled, on_modes)]
difference = np.abs(on_both[1] - on_both[0])
for limit in (0.06, 0.09, 0.12):
    print(f"to {1e3 * limit:.0f} mm the two tips differ by up to {1e3 * np.max(difference[depths <= limit]):.2f} mm")
assert np.max(difference[depths <= 0.06]) < 0.2 * np.max(difference)

# %% [markdown]
# ## Noise and delay
#
# Hold the needle at 60 mm and let the PID go on. The tip answers at once, so the loop is a difference equation: with p = g P, q = g I T and
# images that come d periods late
#
#     y (z^2 - z + [(p + q) z - p] z^-d) = -[(p + q) z - p] n
#
# Noise n of the images moves the tip through the finger, in proportion; a delay moves the poles, and from some delay on one leaves the unit circle.

# %%
share, period = 0.2, 1.0 / 30.0
held = stiff.with_values({"insertion": {"kind": "hold", "initial_depth": 0.06}, "run.duration": 1.0, "target": {}})
held = held.with_values({"numerics.analysis": "static", "numerics.elements": 12, "controller.schedule": "none"})
held_gain = model_response(build_plant(held), "lateral_force", depths=(0.06, 0.06)).largest_gain
gains = {"proportional": share / held_gain, "integral": share / (held_gain * period)}
held = held.with_values({"controller.period": period, "actuators": {}})


def tips(noise, delay, decisions, gains=gains):
    """Return the tip [m] after each decision, for images with noise [m] that come late by a number of periods."""
    image = {"kind": "tip-imaging", "period": period, "noise": noise, "delay": delay * period}
    loop = held.with_values({"sensors": [image], "controller.gains": gains, "run.duration": decisions * period})
    controller, needle = controller_of(loop), Simulation(build_plant(loop))
    state, found = controller.begin(), []
    for _ in range(decisions):
        state, command = controller.update(state, needle.time, needle.measurement())
        needle.step(command, period)
        found.append(needle.tip_deflection)
    return np.array(found)


impulse = np.zeros(400)
impulse[0] = 1.0
noise_gain = np.sqrt(np.sum(lfilter([0.0, -2.0 * share, share], [1.0, 2.0 * share - 1.0, -share], impulse) ** 2))
noises = np.array([0.1, 0.5, 1.0]) * 1e-3
deviations = np.array([np.std(tips(noise, 0, 2000)[100:]) for noise in noises])
print("tip by noise:", np.round(deviations / noises, 3), f"expected {noise_gain:.3f}")
assert np.all(np.abs(deviations / noises / noise_gain - 1.0) < 0.1)

figure, (left, right) = plt.subplots(1, 2, figsize=(11, 3.6), layout="constrained")
left.plot(1e3 * noises, 1e3 * deviations, "C0o", label="needle")
left.plot(1e3 * noises, 1e3 * noise_gain * noises, "k--", label="difference equation")
left.set(xlabel="noise of the images [mm]", ylabel="deviation of the tip [mm]")
left.legend()
for delay, line in ((0, "C0"), (4, "C1--"), (9, "C2:")):
    polynomial = np.zeros(delay + 3)
    polynomial[:2] = 1.0, -1.0
    polynomial[-2:] += 2.0 * share, -share
    slowest = np.max(np.abs(np.roots(polynomial)))
    tip = tips(0.0, delay, 180)
    right.plot(period * np.arange(1, 181), 1e3 * tip, line, label=f"{1e3 * delay * period:.0f} ms, pole {slowest:.3f}")
    growth = np.max(np.abs(tip[-60:])) / np.max(np.abs(tip[-120:-60]))
    print(f"delay {1e3 * delay * period:.0f} ms: from one 2 s to the next the swing changes by {growth:.2g}, expected {slowest**60:.2g}")
    assert (growth > 1.0) == (slowest > 1.0)
careful = tips(0.0, 9, 180, gains={})
right.plot(period * np.arange(1, 181), 1e3 * careful, "k", linewidth=0.8, label="300 ms, default gains")
right.set(xlabel="time [s]", ylabel="tip deflection [mm]")
right.legend(title="delay", loc="upper left", bbox_to_anchor=(1.0, 1.0))
plt.show()
print(f"delay 300 ms, default gains: {1e3 * careful[-1]:.3f} mm after 6 s")
assert abs(careful[-1]) < 0.05 * abs(careful[0])

# %% [markdown]
# Gains that are left to the default count the delay that the scene tells: the same late images leave the loop stable, and slower.
#
# ## Many insertions
#
# No two pieces of tissue are alike. `[scatter]` draws modulus, entry angle and speed anew for each repetition, and the sensors' noise differs.
# `repeat` tells the errors at the target; a controller is judged by both their mean and their deviation.

# %%
brief = scene.with_value("numerics.output_step", 0.3)
free = repeat(brief.with_value("controller.kind", "none"), 10, processes=1)
many = repeat(brief, 10, processes=1)
figure, axes = plt.subplots(figsize=(7, 3.6), layout="constrained")
for study, color, name in ((free, "gray", "left alone"), (many, "C0", "controlled")):
    print(f"{name}: {1e3 * study.mean:.2f} mm, deviation {1e3 * study.standard_deviation:.2f} mm, largest {1e3 * study.largest_error:.2f} mm")
    for index, one in enumerate(study.repetitions):
        axes.plot(1e3 * one.depth, 1e3 * one.tip_deflection, color=color, linewidth=0.7, label=None if index else name)
axes.set(xlabel="depth [mm]", ylabel="tip deflection [mm]")
axes.legend()
plt.show()
assert many.failed == free.failed == 0
assert many.standard_deviation < free.standard_deviation
assert many.largest_error < 0.5 * free.mean

# %% [markdown]
# ## Trying out
#
# `state` is a copy of everything: needle, sensors with their noise, what is on its way. `restore` goes back there, so that a controller can try
# commands on the needle itself before it decides. Here one looks 0.3 s ahead in each of its decisions, with three forces.

# %%
needle, force = Simulation(build_plant(stiff), time_step=0.02, output_step=0.1), 0.0
started, tried = perf_counter(), 0
while needle.depth < 0.06:
    before, found = needle.state, {}
    for candidate in (force - 0.5, force, force + 0.5):
        needle.step({"lateral_force": candidate}, 0.3)
        found[candidate] = abs(needle.tip_deflection)
        needle.restore(before)
        tried += 1
    force = min(found, key=found.get)
    needle.step({"lateral_force": force}, 0.1)
print(f"tip {1e3 * needle.tip_deflection:.2f} mm, {1e6 * (perf_counter() - started) / tried:.0f} us for a trial of 15 steps")
free = Simulation(build_plant(stiff.with_values({"controller": {"kind": "none"}})), time_step=0.02)
free.step({}, needle.time)
print(f"left alone: {1e3 * free.tip_deflection:.2f} mm")
assert abs(needle.tip_deflection) < 0.3 * abs(free.tip_deflection)
