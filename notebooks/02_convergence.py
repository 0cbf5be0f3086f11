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
# # 02 Convergence
#
# How many elements does a tip deflection need? A convergence study answers with errors against an exact solution where there is one, with
# Richardson's extrapolation and the grid convergence index where there is none.

# %%
# %matplotlib inline
import matplotlib.pyplot as plt
import numpy as np

from fem_needle import converge, load_scene

scene = load_scene("bench-s")
print(scene.title)

# %% [markdown]
# ## Elements
#
# A static needle, cubic (degree 3) and quartic (degree 4) elements. The tip of a beam under a tip force is its compliance, an energy: it
# converges twice as fast as the bending moment, with the power 2 (p - 1) of the element's length.

# %%
figure, axes = plt.subplots(figsize=(6, 4), layout="constrained")
for degree, marker in ((3, "o"), (4, "s")):
    study = converge(scene, over="elements", values=(1, 2, 4, 8, 16), degree=degree)
    print(f"degree {degree}: {study.reference}")
    for row in study.rows:
        order = "" if row.observed_order is None else f"{row.observed_order:.2f}"
        print(f"  {row.value:4g} elements: error {row.error:.1e}, order {order}")
    axes.loglog([row.value for row in study.rows], [row.error for row in study.rows], marker=marker, label=f"degree {degree}")
counts = np.array([1.0, 16.0])
axes.loglog(counts, 3e-4 * counts**-4.0, "k--", label="power -4")
axes.loglog(counts, 5e-6 * counts**-6.0, "k:", label="power -6")
axes.set(xlabel="elements", ylabel="tip error")
axes.legend()
plt.show()

# %% [markdown]
# Errors of the quartic elements meet round-off from 16 elements on: a finer mesh would not be better, and the study says so instead of
# showing an order that means nothing.

# %% [markdown]
# ## Modes
#
# The same study over the number of assumed modes. A mode that is left out costs the tip 4 / (l EI b^4), b its wave number: the sum of
# the rest falls with the third power.

# %%
modal = scene.with_values({"model.kind": "assumed-modes", "model.basis": "inserted-length"})
study = converge(modal, over="modes", values=(2, 4, 8, 16, 32))
for row in study.rows:
    order = "" if row.observed_order is None else f"{row.observed_order:.2f}"
    print(f"{row.value:4g} modes: error {row.error:.1e}, order {order}")
assert abs(study.rows[-1].observed_order - 3.0) < 0.2
