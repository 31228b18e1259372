"""Parts of the group `tune`: constants and methods of the program may be chosen by their results."""

import drawings_tune as d
from drawing import moved, part, ring_of, without

PARTS = dict(
    t_plate=part(
        d.stamped_plate,
        (430, 50),
        True,
        [
            ("hole moved", lambda: d.stamped_plate(moved(d.PLATE_HOLES, 3, 5, -5))),
            ("hole missing", lambda: d.stamped_plate(without(d.PLATE_HOLES, 4))),
            ("slot is a hole", lambda: d.stamped_plate([*d.PLATE_HOLES, (15, -10, 2.5)], ())),
        ],
        longer=(-18.5, -17),
    ),
    t_zbracket=part(
        d.z_bracket,
        (350, 55),
        True,
        [
            ("hole moved", lambda: d.z_bracket(moved(d.Z_HOLES, 0, 5, -1))),
            ("hole missing", lambda: d.z_bracket(without(d.Z_HOLES, 1))),
            ("corner not cut", lambda: d.z_bracket(corner=0)),
        ],
        longer=(-2, 4),
        grasp=(-17, 0, 3, 0),
    ),
    t_lever=part(
        d.lever,
        (420, 52),
        True,
        [
            ("hole moved", lambda: d.lever(moved(d.LEVER_HOLES, 1, 5.5, -2))),
            ("hole missing", lambda: d.lever(without(d.LEVER_HOLES, 1))),
            ("slot is a hole", lambda: d.lever([*d.LEVER_HOLES, (-18, 0.5, 2.5)], ())),
        ],
        longer=(8, 28),
    ),
    t_gear=part(
        d.gear,
        (380, 47),
        False,
        [
            ("hole missing", lambda: d.gear(ring_of(4, 17.5, 5.5)[:3])),
            ("holes further in", lambda: d.gear(ring_of(4, 15.5, 3.5))),
            ("six holes", lambda: d.gear(ring_of(6, 17.5, 5.5))),
            ("other size", lambda: d.gear(size=1.2)),
        ],
        sym=4,
    ),
    t_cam=part(
        d.cam_disc,
        (340, 54),
        True,
        [
            ("hole moved", lambda: d.cam_disc(((-8, 10.5, 2.8),))),
            ("hole missing", lambda: d.cam_disc(())),
            ("lower rise", lambda: d.cam_disc(rise=11.0)),
        ],
    ),
    t_saddle=part(
        d.pipe_saddle,
        (370, 48),
        False,
        [
            ("hole moved", lambda: d.pipe_saddle([(-17.5, 0, 3.2)])),
            ("hole missing", lambda: d.pipe_saddle([])),
            ("slot is a hole", lambda: d.pipe_saddle([*d.SADDLE_HOLES, (22, 0, 3.2)], ())),
        ],
        longer=(13, 15),
    ),
    t_lug=part(
        d.cable_lug,
        (330, 50),
        False,
        [
            ("hole moved", lambda: d.cable_lug((15, 0, 5.2))),
            ("hole missing", lambda: d.cable_lug(None)),
            ("other colour", lambda: d.cable_lug(mat="copper")),
        ],
        longer=(2, 12),
    ),
    t_heatsink=part(
        d.heatsink,
        (400, 56),
        True,
        [
            ("hole missing", lambda: d.heatsink(d.HEATSINK_HOLES[:1])),
            ("fewer fins", lambda: d.heatsink(fins=7)),
        ],
        longer=(6, 14),
        sym=2,
    ),
    t_board=part(
        d.circuit_board,
        (400, 46),
        True,
        [
            ("other print", lambda: d.circuit_board("t_board2", 47, label="KD-17")),
            ("other colour mark", lambda: d.circuit_board("t_board3", mark=(-27, -14, 3.2, (225, 205, 40)))),
            ("connector missing", lambda: d.circuit_board(connector=False)),
        ],
        longer=(4, 6.5),
    ),
    t_knob=part(
        d.knob,
        (310, 50),
        False,
        [
            ("other print", lambda: d.knob("dot")),
            ("mark missing", lambda: d.knob(None)),
            ("other colour mark", lambda: d.knob(colour="0.85,0.12,0.1")),
            ("other size", lambda: d.knob(size=1.2)),
        ],
    ),
    t_hook=part(
        d.hook,
        (370, 53),
        True,
        [("smaller hook", lambda: d.hook(8.5)), ("end longer", lambda: d.hook(tip=22.0))],
        longer=(-18, 0),
    ),
    t_spanner=part(
        d.spanner,
        (470, 55),
        True,
        [("hole missing", lambda: d.spanner(False)), ("smaller jaw", lambda: d.spanner(jaw=9.0))],
        longer=(-20, 20),
    ),
    t_block=part(
        d.pocket_block,
        (370, 57),
        True,
        [
            ("hole moved", lambda: d.pocket_block(moved(d.BLOCK_HOLES, 3, -5.5, 0))),
            ("hole missing", lambda: d.pocket_block(without(d.BLOCK_HOLES, 1))),
            ("pocket moved", lambda: d.pocket_block(pocket=(-9, -2))),
        ],
        longer=(8.5, 9.7),
    ),
    t_retainer=part(
        d.retainer,
        (400, 49),
        True,
        [
            ("holes moved", lambda: d.retainer([(25, 9, 3.0), (-25, -9, 3.0)])),
            ("hole missing", lambda: d.retainer(d.RETAINER_HOLES[:1])),
        ],
        longer=(15.5, 23),
        sym=2,
    ),
    t_castarm=part(
        d.cast_arm,
        (440, 51),
        True,
        [
            ("lug missing", lambda: d.cast_arm(lug=False)),
            ("hole missing", lambda: d.cast_arm(lug_hole=False)),
        ],
        longer=(10, 24),
    ),
    t_housing=part(
        d.connector_housing,
        (330, 52),
        True,
        [
            ("fewer pins", lambda: d.connector_housing(5)),
            ("rib moved", lambda: d.connector_housing(ribs=(-13, 14))),
            ("latch missing", lambda: d.connector_housing(latch=False)),
        ],
    ),
)
