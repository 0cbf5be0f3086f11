"""The kernel's arrays: what their rows and columns mean. Shapes and units: docs/architecture.md, "The kernel's arrays"."""

from __future__ import annotations

# Instants of a step: its nodes, its end, its start.
NODES, END, START, INSTANTS = 3, 3, 4, 5

# Matrices of a block that belong to the beam, and of a block of tissue; the unit integrals of a piece.
MASS, BENDING, CONVECTION, CENTRIFUGAL = range(4)
TISSUE, DAMPING, DRAG, SLIP = range(4)
UNIT_MASS, UNIT_DRAG, UNIT_SLIP, UNIT_BENDING = range(4)

# Where a place on the axis lies on the shapes.
MATERIAL, STRETCHED, FIXED = range(3)

# switches: whole numbers of a needle.
(
    FRAME,
    PRESCRIBED,
    GUIDES,
    POINTS,
    TIPS,
    STRIDE,
    DEGREE,
    INERTIA,
    VISCOUS,
    CONVECTED,
    CUTS,
    TURNS,
    AXIAL_ACTS,
    PRINTED,
    GIVEN,
    RESOLVES,
) = range(16)
SWITCHES = 16

# numbers: SI.
(
    LENGTH,
    MASS_PER_LENGTH,
    BENDING_STIFFNESS,
    SMALLEST_DEPTH,
    TIP_STIFFNESS,
    COULOMB,
    COULOMB_PER_LENGTH,
    VISCOUS_FRICTION,
    VISCOUS_FRICTION_PER_LENGTH,
    SOFTEST,
    PRINTED_STIFFNESS,
) = range(11)
NUMBERS = 11

# layers: a row each.
LAYER_START, LAYER_END, MODULUS, VISCOSITY, CUTTING = range(5)

# signals: what varies in time; loads follow, and of each tip load its force and its direction.
DEPTH_SIGNAL, FACTOR_SIGNAL, HUB_SIGNAL, ANGLE_SIGNAL, PUSH_SIGNAL, LOAD_SIGNAL = range(6)
# a row of a signal: value + slope x + half_curvature x^2 + a wave, x = time - start.
ROW_START, ROW_VALUE, ROW_SLOPE, ROW_CURVE, ROW_AMPLITUDE, ROW_OMEGA, ROW_PHASE, ROW_SUMMED = range(8)
ROW = 8

# course: the insertion at an instant.
TIME, DEPTH, SPEED, ACCELERATION, FACTOR, FACTOR_RATE, SIDE, STRETCH, OWN_DEPTH, OWN_SIDE = range(10)
COURSE = 10

# axial: the part of the state that is no coordinate. MEMORY of the last step follows the motion.
(
    NOW,
    WAY,
    PACE,
    DEEPEST,
    NODE_PACE_1,
    NODE_PACE_2,
    LAST_LENGTH,
    LAST_POWER,
    LAST_PRODUCT,
    LAST_AXIAL_PRODUCT,
    LAST_HUB_PRODUCT,
    PENDING,
    FRONT,
    LANDED,
    STEPS,
    AXIAL_FORCE,
    LAST_AXIAL_MOMENTUM,
    LAST_HUB_RATE,
    LAST_ANGLE_RATE,
    ROUNDS,
    LAST_PACE,
    PIERCED,
    ARRESTED,
) = range(23)
AXIAL = 23

# ledger: works since the start [J].
(
    LOAD_WORK,
    HUB_WORK,
    TISSUE_WORK,
    DISSIPATION,
    BOUNDARY,
    FRICTION_LOSS,
    CUTTING_WORK,
    PUSH_WORK,
    ARREST_LOSS,
) = range(9)
LEDGER = 9

# record: what is kept of an output; coordinates, point forces, guides' shown forces and the coordinates' first and second
# derivatives in time follow.
(
    R_TIME,
    R_DEPTH,
    R_SPEED,
    R_PUSH,
    R_FRICTION,
    R_CUTTING,
    R_TISSUE,
    R_HUB,
    R_MOMENT,
    R_KINETIC,
    R_BENDING,
    R_ELASTIC,
    R_GUIDE,
    R_INSERTION,
    R_AXIAL,
    R_TIP,
    R_PIECES,
    R_WORKS,
) = range(18)
RECORD = R_WORKS + LEDGER

# sums of an instant, kept for the ledger.
S_POWER, S_MOMENTUM, S_CONFIGURATION = range(3)
SUMS = 3

# how a call of the loop ends.
DONE, FAILED, EVENT, DIVERGED = range(4)

# arrays: names in the table that compiled functions take (`fem_needle.dynamics.arrays`).
# Of a needle.
(
    SWITCH,
    NUMBER,
    LAYER,
    POSITION,
    COMPLIANCE,
    BEVEL,
    ONE,
    MASS_FACTOR,
    PASCAL,
    PIECE_NODES,
    COEFFICIENTS,
    RULE,
    UNIT,
    UNIT_SUMS,
    BEAM,
    SIGNALS,
    SIGNAL_ENDS,
    INVERSE,
    METHOD,
    POWER_SLOPES,
) = range(20)
# The state.
LATERAL, AXIAL_STATE, LEDGER_STATE, HELD, PATH_EDGES, PATH_CUBICS, PATH_MOMENTS, PATH_SQUARES, PATH_COUNT = range(20, 29)
# At the instants of a step.
(
    COURSES,
    CLAMP,
    FORCES,
    FORCE_RATES,
    PATH_LOAD,
    PATH_LOAD_RATE,
    PATH_CONSTANTS,
    KNOWN,
    RATES,
    MOMENTA,
    PRINTED_ERRORS,
    TISSUE_BLOCKS,
    COVERED,
    POINT_ROWS,
    POINT_RATES,
    POINT_FIRST,
    POINT_PLACES,
    FLEXIBLE,
    FLEXIBLE_RATE,
    INSTANT_SUMS,
    NODE_TIPS,
) = range(29, 50)
# Work space.
(
    FRESH,
    CHANGED,
    OTHER_CHANGED,
    KEY,
    SHAPE,
    SIDES,
    ANSWER,
    COLUMNS,
    ANSWERS,
    DENSE,
    SCRATCH,
    GAPS,
    GUIDE_FORCES,
    CHOSEN,
    CUT_COLUMNS,
    CUT_LOAD,
    CUT_LOAD_RATE,
    CUBIC,
    OTHER_CUBIC,
    CUT_PAIR,
    CUT_MOMENTS,
    MATRICES,
    NODE_MATRICES,
    SHARES,
    FACTORS,
    STIFFNESSES,
    BEAM_GAPS,
    VECTORS,
    PAIR,
    KEPT_LATERAL,
    KEPT_AXIAL,
    KEPT_LEDGER,
    KEPT_HELD,
) = range(50, 83)
# A call.
INTERVALS, CURSOR, LIMITS, RECORDS = range(83, 87)
ENDS_AT_OUTPUT, BEGINS_AT_KINK = 1, 2  # of an interval, added
# A model that is asked: its address, what it answers. Directions that a model resolves, how many, and work space.
ASKED, ANSWERED, ANSWERED_LOAD, SUBSPACE, RANKS, REDUCED, REDUCED_VALUES, REDUCED_WORK = range(87, 95)
ARRAYS = 95

# rows of METHOD.
PLACES, WEIGHTS, END_SHARES, START_SLOPE, END_SLOPE = range(5)

# limits: of a push.
IS_PUSHED, DIRECTION, CUTTING_LIMIT, LEVEL, AHEAD, INWARD, OUTWARD, EVENTS, COUNTED = range(9)
LIMITS_SIZE = 9

KINK, CONTINUED = 1.0, 2.0  # of LANDED: what precedes a step; the latter is the start of a call
ROUNDINGS = 1e-12  # of a depth: what a step may miss the deepest point by

# A model that gives its matrices depth by depth: what is asked of it, and where the answers stand.
ASK_MATRICES, ASK_ENERGY_FORCE, ASK_HISTORY, ASK_FRESH = range(4)
