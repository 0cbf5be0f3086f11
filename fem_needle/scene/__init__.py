"""Physics only: what a needle, its support, the tissue and the insertion are."""

from fem_needle.scene.insertion import Insertion
from fem_needle.scene.loads import LateralLoad, Load, TipLoad
from fem_needle.scene.needle import Needle
from fem_needle.scene.scene import Scene
from fem_needle.scene.settings import Friction, Initial, Model, Numerics, Run
from fem_needle.scene.steering import Actuator, Actuators, Controller, Gains, Scatter, Sensor, Target
from fem_needle.scene.support import Guide, Support
from fem_needle.scene.time_functions import Constant, Sinusoid, Table, TimeFunction, as_function
from fem_needle.scene.tissue import Layer, Tissue

__all__ = [
    "Actuator",
    "Actuators",
    "Constant",
    "Controller",
    "Friction",
    "Gains",
    "Guide",
    "Initial",
    "Insertion",
    "LateralLoad",
    "Layer",
    "Load",
    "Model",
    "Needle",
    "Numerics",
    "Run",
    "Scatter",
    "Scene",
    "Sensor",
    "Sinusoid",
    "Support",
    "Table",
    "Target",
    "TimeFunction",
    "TipLoad",
    "Tissue",
    "as_function",
]
