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
# # 01 Insertion
#
# A needle goes into soft tissue, a force at its tip bends it, the tissue pushes back. We run a shipped scene, look at the shapes, and
# check the energy ledger. Lengths are in mm in the pictures and in m in the data; deflections are positive in the sense of a
# positive lateral force.

# %%
# %matplotlib inline
import matplotlib.pyplot as plt
import numpy as np

from fem_needle import FiniteElementNeedle, load_scene, run_scene, solve_static

scene = load_scene("thesis")
print(scene.title)
print(f"length {1e3 * scene.needle.length:g} mm, bending stiffness {scene.needle.bending_stiffness:.4g} N m^2")
print(f"foundation {scene.tissue.layers[0].foundation_modulus:g} N/m^2, final depth {1e3 * scene.insertion.final_depth:g} mm")

# %% [markdown]
# ## The run
#
# `run_scene` chooses elements, time step and analysis from the scene's tolerance. The summary says what it chose and what it left out.

# %%
run = run_scene(scene)
for name in ("analysis", "elements", "time_step", "max_abs_tip_deflection", "error_estimate", "relative_energy_residual"):
    print(f"{name}: {run.summary[name]}")
for skipped in run.summary["skipped"]:
    print(f"left out: {skipped['term']}, {skipped['reason']}")

# %%
figure, (left, right) = plt.subplots(1, 2, figsize=(10, 3.6), layout="constrained")
left.plot(1e3 * run.depth, 1e3 * run.tip_deflection)
left.set(xlabel="depth [mm]", ylabel="tip deflection [mm]")
stations = np.linspace(0.0, scene.needle.length, 201)
shapes = run.deflection(stations)
for depth in (0.06, 0.1, 0.14, 0.18):
    index = int(np.argmin(np.abs(run.depth - depth)))
    inside = stations >= scene.needle.length - run.depth[index]
    position = stations[inside] - (scene.needle.length - run.depth[index])
    right.plot(1e3 * position, 1e3 * shapes[index, inside], label=f"{1e3 * run.depth[index]:.0f} mm")
right.set(xlabel="position below the skin [mm]", ylabel="deflection [mm]")
right.legend(title="depth")
plt.show()

# %% [markdown]
# ## The ledger
#
# Each energy and each work is computed on its own. What the load gives goes into bending, into the tissue, and through the skin: a bent
# needle is pushed out of its sleeve, the boundary energy.

# %%
figure, axes = plt.subplots(figsize=(6, 3.6), layout="constrained")
for name, label in (
    ("load_work", "work of the tip force"),
    ("bending_energy", "bending"),
    ("tissue_energy", "tissue"),
    ("boundary_energy", "boundary"),
):
    axes.plot(1e3 * run.depth, 1e6 * getattr(run, name), label=label)
axes.set(xlabel="depth [mm]", ylabel="energy [uJ]")
axes.legend()
plt.show()
gap = run.bending_energy + run.tissue_energy - run.load_work - run.boundary_energy
print(f"largest gap: {np.max(np.abs(gap - gap[0])):.1e} J")
assert np.max(np.abs(gap - gap[0])) < 1e-6 * np.max(run.bending_energy)

# %% [markdown]
# ## Change something
#
# Any value of the scene has a path. A ten times stiffer tissue lets the same force bend the needle much less.

# %%
for modulus in (520.0, 5200.0):
    changed = scene.with_value("tissue.layers.0.foundation_modulus", modulus)
    rest = solve_static(FiniteElementNeedle(changed, elements=16), depth=0.18)
    print(f"k = {modulus:g} N/m^2: tip {1e3 * rest.tip_deflection:.3f} mm")
