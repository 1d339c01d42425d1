"""Where each quantity of the lanes lies: the number of its first row in one flat array.

Symmetric tensors take six rows: xx, yy, zz, yz, xz, xy, in Mandel components unless said *plain*; a general
3 × 3 matrix takes nine. Stress is over p_ref, force over p_ref r² (see `contact`).
"""

from itertools import accumulate

import numpy as np

_COUNTS = {
    # what one contact plane reads
    "FORCE": 9,  # Z at the end of the step, f = Z n (+ base)
    "FORCE_OLD": 9,  # Z at its start
    "FRICTION": 1,  # tanφ_p at the end
    "DILATANCY": 1,  # tanφ_d at the middle
    "FABRIC_MIDDLE": 6,  # F at the middle, plain
    "MARGIN": 1,  # positive inside the domain
    "SHARE": 1,  # of the sliding required that is done in this sub-step; 1 but for relaxed ones
    "TAKEN": 1,  # whether the trial evaluated last was accepted
    "FRESH": 1,  # whether the sub-step has just begun
    "FACTOR": 1,  # part of the Newton step in the trial
    "RAISING": 1,  # whether the share is being raised to 1 in this sub-step; 2 where that failed
    "FINAL": 1,  # whether the next equilibrium is near, so that everything is evaluated
    # states and unknowns
    "Y": 13,  # trial end of the step: stress, fabric, void ratio
    "OLD": 13,  # its start
    "ACCEPTED": 12,  # best iterate so far
    "STEP": 12,  # Newton step from there
    "FULL": 6,  # strain increment asked for
    "PART": 6,  # strain increment of this sub-step
    # geometry of the step
    "INVERSE": 6,  # G_m⁻¹, plain
    "SCALED": 6,  # G_s⁻¹ / c_s, plain: dZ = dσ · SCALED
    "BY_FABRIC": 9,  # dZ = −(2/15) BY_FABRIC · dF · SCALED
    "BY_VOID": 1,  # dZ = BY_VOID · (σ or Δσ) · SCALED · de
    "P_FRICTION": 1,
    "P_DILATANCY": 1,
    "E_FRICTION": 1,
    "E_DILATANCY": 1,  # derivatives of the two tangents by p and e
    "PSI": 1,
    "PSI_P": 1,  # state parameter at the middle, and de_c/dp there
    # averages over planes
    "SUMS": 192,  # see `contact`
    "H": 54,  # H of all the displacement
    "WASTE": 3,  # what fills up a group of three sums
    "C": 81,  # H transformed by G_m⁻¹ and SCALED
    "PROJECTED": 9,  # D G_m⁻¹
    "COLUMN_P": 6,
    "COLUMN_E": 6,  # derivative of the strain through the friction angles
    "STRAIN": 6,
    "PLASTIC": 6,  # strain of the step and its plastic part
    "FIRST": 6,  # strain of backward Euler less the strain
    "SLOPE": 78,
    "PLASTIC_SLOPE": 78,  # 6 × 13: by stress, fabric, void ratio
    "GEO": 36,
    "PLASTIC_GEO": 36,  # part of it by fabric at fixed forces
    # fabric law
    "INPUTS": 31,
    "GAIN": 6,
    "GAIN_END": 6,
    "LAW_SLOPE": 186,
    "RATIO_SLOPE": 36,
    "RATIO_OLD": 36,
    "FABRIC_SLOPE": 78,
    # linear system
    "MATRIX": 144,
    "NEWTON": 12,  # minus the residual, then the Newton step
    "TANGENT": 72,  # n × 6 right-hand sides, then derivatives of the unknowns by the strain increment
    "ERRORS": 12,  # first-order minus second-order residual, then the error of the unknowns
    "NORM": 1,
    "LENGTH": 1,  # norm of the residual, of the sub-step
    "STRESS_NORM": 1,
    "STRESS_ERROR": 1,
    "FABRIC_ERROR": 1,
    # step control
    "FRACTION": 1,
    "PORTION": 1,  # done, and of this sub-step
    "BEST": 1,  # residual of the accepted iterate
    "ERROR": 1,
    "VOID_START": 1,
    "CLOSING": 1,  # part of the increment that went into closing a gap
    "BY_VOID_STRAIN": 1,  # de/dε_v of the end of the sub-step
}

# numpy integers: the compiler would make a version of every function for each value of a Python integer
_STARTS = {name: np.int64(row) for name, row in zip(_COUNTS, accumulate([0, *_COUNTS.values()]), strict=False)}
ROWS = sum(_COUNTS.values())

FORCE, FORCE_OLD, FRICTION, DILATANCY = (_STARTS[k] for k in ("FORCE", "FORCE_OLD", "FRICTION", "DILATANCY"))
FABRIC_MIDDLE, MARGIN, SHARE, FINAL = (_STARTS[k] for k in ("FABRIC_MIDDLE", "MARGIN", "SHARE", "FINAL"))
TAKEN, FRESH, RAISING = _STARTS["TAKEN"], _STARTS["FRESH"], _STARTS["RAISING"]
Y, OLD, ACCEPTED, STEP, FULL, PART = (_STARTS[k] for k in ("Y", "OLD", "ACCEPTED", "STEP", "FULL", "PART"))
INVERSE, SCALED, BY_FABRIC, BY_VOID = (_STARTS[k] for k in ("INVERSE", "SCALED", "BY_FABRIC", "BY_VOID"))
P_FRICTION, P_DILATANCY = _STARTS["P_FRICTION"], _STARTS["P_DILATANCY"]
E_FRICTION, E_DILATANCY = _STARTS["E_FRICTION"], _STARTS["E_DILATANCY"]
PSI, PSI_P = _STARTS["PSI"], _STARTS["PSI_P"]
SUMS, WASTE, C, PROJECTED = _STARTS["SUMS"], _STARTS["WASTE"], _STARTS["C"], _STARTS["PROJECTED"]
COLUMN_P, COLUMN_E = _STARTS["COLUMN_P"], _STARTS["COLUMN_E"]
STRAIN, PLASTIC, FIRST = _STARTS["STRAIN"], _STARTS["PLASTIC"], _STARTS["FIRST"]
SLOPE, PLASTIC_SLOPE, GEO, PLASTIC_GEO = (_STARTS[k] for k in ("SLOPE", "PLASTIC_SLOPE", "GEO", "PLASTIC_GEO"))
INPUTS, GAIN, GAIN_END = _STARTS["INPUTS"], _STARTS["GAIN"], _STARTS["GAIN_END"]
LAW_SLOPE, RATIO_SLOPE, RATIO_OLD = _STARTS["LAW_SLOPE"], _STARTS["RATIO_SLOPE"], _STARTS["RATIO_OLD"]
FABRIC_SLOPE = _STARTS["FABRIC_SLOPE"]
MATRIX, NEWTON = _STARTS["MATRIX"], _STARTS["NEWTON"]
TANGENT, ERRORS = _STARTS["TANGENT"], _STARTS["ERRORS"]
NORM, LENGTH, STRESS_NORM = _STARTS["NORM"], _STARTS["LENGTH"], _STARTS["STRESS_NORM"]
STRESS_ERROR, FABRIC_ERROR = _STARTS["STRESS_ERROR"], _STARTS["FABRIC_ERROR"]
FRACTION, PORTION, FACTOR, BEST, ERROR, VOID_START, CLOSING, BY_VOID_STRAIN = (
    _STARTS[k] for k in ("FRACTION", "PORTION", "FACTOR", "BEST", "ERROR", "VOID_START", "CLOSING", "BY_VOID_STRAIN")
)

#: columns of a slope: six stresses, six fabric components, the void ratio; and where those start
COLUMNS, FABRIC, VOID = np.int64(13), np.int64(6), np.int64(12)
#: inputs of a fabric law
LAW_INPUTS = np.int64(31)

# the buffer of one direction (each quantity times its weight)
DISPLACEMENT, SLIPPED, LATE, BY_FRICTION, BY_DILATANCY = (np.int64(k) for k in (0, 3, 6, 9, 12))
STIFFNESS_SLIPPED, BARE, BARE_SLIPPED, BY_TANGENT, BY_NORMAL, BUFFER = (np.int64(k) for k in (13, 22, 25, 28, 29, 32))

# the sums over directions, from SUMS on
D, D_SLIPPED, D_LATE, D_FRICTION, D_DILATANCY = SUMS, SUMS + 9, SUMS + 18, SUMS + 27, SUMS + 36
H_SLIPPED, T, T_SLIPPED, TANGENTIAL, ELASTIC = SUMS + 42, SUMS + 96, SUMS + 126, SUMS + 156, SUMS + 162
H = _STARTS["H"]

# order of symmetric pairs and triples of axes; the triple of an axis and a pair
AXES = range(3)
PAIR = [(0, 0), (1, 1), (2, 2), (1, 2), (0, 2), (0, 1)]
TRIPLE = [(i, j, k) for i in AXES for j in AXES for k in AXES if i <= j <= k]
TRIPLES = np.array([[[sorted(t) for t in TRIPLE].index(sorted((k, *pair))) for pair in PAIR] for k in AXES])
