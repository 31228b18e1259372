"""Parts of the group `untuned`: their results are only reported; no constant or method is chosen by them."""

import drawings_untuned as d
from drawing import moved, part, ring_of, without

PARTS = dict(
    u_nameplate=part(
        d.nameplate,
        (390, 50),
        True,
        [
            ("other print", lambda: d.nameplate("u_nameplate2", 617)),
            ("other print", lambda: d.nameplate("u_nameplate3", 628)),
            ("other colour mark", lambda: d.nameplate("u_nameplate4", 611, ink=(120, 24, 24))),
            ("hole missing", lambda: d.nameplate(holes=((-29, 0, 1.8),))),
        ],
    ),
    u_hinge=part(
        d.hinge_leaf,
        (350, 56),
        True,
        [
            ("hole moved", lambda: d.hinge_leaf(moved(d.HINGE_HOLES, 1, 1, 5))),
            ("hole missing", lambda: d.hinge_leaf(without(d.HINGE_HOLES, 0))),
            ("three knuckles", lambda: d.hinge_leaf(knuckles=((-28, -16), (-5, 7), (18, 28)))),
        ],
        longer=(9, 15),
    ),
    u_ratchet=part(
        d.ratchet,
        (360, 48),
        True,
        [
            ("hole missing", lambda: d.ratchet(ring_of(4, 15.5, 4.0, 20)[:3])),
            ("six holes", lambda: d.ratchet(ring_of(6, 15.5, 4.0, 20))),
            ("fewer teeth", lambda: d.ratchet(teeth=12)),
            ("other size", lambda: d.ratchet(size=1.2)),
        ],
        sym=4,
    ),
    u_pawl=part(
        d.pawl,
        (350, 52),
        True,
        [
            ("hole moved", lambda: d.pawl(moved(d.PAWL_HOLES, 1, -4.5, -1))),
            ("hole missing", lambda: d.pawl(without(d.PAWL_HOLES, 1))),
            ("tail missing", lambda: d.pawl(tail=False)),
        ],
        longer=(-10, -1),
    ),
    u_strike=part(
        d.strike_plate,
        (410, 53),
        True,
        [
            ("hole moved", lambda: d.strike_plate(moved(d.STRIKE_HOLES, 1, -4, -3.5))),
            ("window moved", lambda: d.strike_plate(window=(-3, 0, 24, 11))),
            ("small window missing", lambda: d.strike_plate(small=None)),
        ],
        longer=(21, 25),
    ),
    u_gusset=part(
        d.gusset,
        (430, 49),
        True,
        [
            ("hole moved", lambda: d.gusset(moved(d.GUSSET_HOLES, 1, 6.5, 0))),
            ("hole missing", lambda: d.gusset(without(d.GUSSET_HOLES, 1))),
            ("window missing", lambda: d.gusset(window=False)),
        ],
        longer=(10, 22),
    ),
    u_motorplate=part(
        d.motor_plate,
        (400, 57),
        False,
        [
            ("hole missing", lambda: d.motor_plate(ring_of(4, 28.3, 2.6, 45)[:3])),
            ("hole moved", lambda: d.motor_plate(moved(ring_of(4, 28.3, 2.6, 45), 0, -4, -4))),
            ("holes further in", lambda: d.motor_plate(ring_of(4, 23.5, 2.6, 45))),
            ("other size", lambda: d.motor_plate(size=1.2)),
        ],
        sym=4,
    ),
    u_impeller=part(
        d.impeller,
        (390, 51),
        True,
        [
            ("fewer vanes", lambda: d.impeller(6)),
            ("hole missing", lambda: d.impeller(holes=((17.5, 0, 2.6),))),
            ("holes missing", lambda: d.impeller(holes=())),
        ],
        sym=2,
    ),
    u_crank=part(
        d.crank,
        (440, 54),
        True,
        [
            ("hole missing", lambda: d.crank(hub_hole=False)),
            ("other colour", lambda: d.crank(handle="0.1,0.3,0.7")),
            ("straight", lambda: d.crank(bend=-1.5)),
        ],
        longer=(-19, -4),
        grasp=(-13, 4, 13, 4),
    ),
    u_bellcrank=part(
        d.bell_crank,
        (390, 47),
        True,
        [
            ("hole moved", lambda: d.bell_crank(moved(d.BELL_HOLES, 1, -4.5, 0))),
            ("hole missing", lambda: d.bell_crank(without(d.BELL_HOLES, 3))),
        ],
        longer=(5, 20),
    ),
    u_terminal=part(
        d.barrier_strip,
        (380, 50),
        True,
        [
            ("fewer poles", lambda: d.barrier_strip(4)),
            ("screws missing", lambda: d.barrier_strip(screws=False)),
            ("hole missing", lambda: d.barrier_strip(ear_hole=False)),
            ("other colour mark", lambda: d.barrier_strip(colour="0.1,0.45,0.7")),
        ],
    ),
    u_display=part(
        d.display,
        (410, 48),
        True,
        [
            ("other print", lambda: d.display("u_display2", 79, "81.6", "F")),
            ("other colour mark", lambda: d.display("u_display3", 73, mark=(25, -17, 2.6, (225, 120, 30)))),
            ("header missing", lambda: d.display(header=False)),
        ],
        longer=(28.5, 30),
    ),
    u_keypad=part(
        d.keypad,
        (370, 52),
        True,
        [
            ("other print", lambda: d.keypad("u_keypad2", "LRT*580#234X")),
            ("other colour mark", lambda: d.keypad("u_keypad3", colour=(40, 120, 60))),
            ("other colour mark", lambda: d.keypad("u_keypad4", red=8)),
        ],
    ),
    u_snapring=part(
        d.snap_ring,
        (350, 50),
        False,
        [
            ("hole missing", lambda: d.snap_ring(1)),
            ("wider gap", lambda: d.snap_ring(gap=85)),
            ("other size", lambda: d.snap_ring(size=1.2)),
        ],
    ),
    u_idler=part(
        d.idler_arm,
        (400, 55),
        True,
        [
            ("hole moved", lambda: d.idler_arm(moved(d.IDLER_HOLES, 1, -5, 0))),
            ("hole missing", lambda: d.idler_arm(without(d.IDLER_HOLES, 1))),
            ("roller missing", lambda: d.idler_arm(roller=False)),
            ("slot shorter", lambda: d.idler_arm(arc=(6, 26))),
        ],
        longer=(-19, -8),
    ),
    u_support=part(
        d.shaft_support,
        (340, 50),
        False,
        [
            ("hole moved", lambda: d.shaft_support(((-15.5, 3, 2.8), (19, 0, 2.8)))),
            ("hole missing", lambda: d.shaft_support(((-19, 0, 2.8),))),
            ("screw missing", lambda: d.shaft_support(screw=False)),
        ],
        longer=(-15.5, -11.5),
    ),
    u_gasket=part(
        d.gasket,
        (420, 51),
        True,
        [
            ("hole moved", lambda: d.gasket(moved(d.GASKET_HOLES, 3, 7, 0.5))),
            ("hole missing", lambda: d.gasket(without(d.GASKET_HOLES, 1))),
            ("port missing", lambda: d.gasket(port=False)),
        ],
    ),
    u_comb=part(
        d.contact_comb,
        (380, 49),
        True,
        [
            ("hole moved", lambda: d.contact_comb(moved(d.COMB_HOLES, 1, 6, 0))),
            ("hole missing", lambda: d.contact_comb(without(d.COMB_HOLES, 2))),
            ("fewer tines", lambda: d.contact_comb(tines=7)),
        ],
    ),
    u_elbow=part(
        d.elbow,
        (350, 54),
        True,
        [
            ("flange missing", lambda: d.elbow(flange=False)),
            ("fewer barbs", lambda: d.elbow(barbs=1)),
            ("other colour", lambda: d.elbow(colour="0.2,0.45,0.3")),
        ],
        longer=(-4, 3),
    ),
    u_bayonet=part(
        d.bayonet_ring,
        (380, 53),
        True,
        [
            ("entries missing", lambda: d.bayonet_ring(entry=2.3)),
            ("hole missing", lambda: d.bayonet_ring(holes=((0, 25.5, 2),))),
            ("slots shorter", lambda: d.bayonet_ring(length=20)),
        ],
        sym=2,
    ),
    u_wingnut=part(
        d.wing_nut,
        (320, 48),
        False,
        [
            ("hole missing", lambda: d.wing_nut(False)),
            ("20 % shorter", lambda: d.wing_nut(spread=18.5)),
            ("other size", lambda: d.wing_nut(size=1.2)),
        ],
        sym=2,
    ),
    u_carabiner=part(
        d.carabiner,
        (390, 52),
        True,
        [
            ("gate missing", lambda: d.carabiner(gate=False)),
            ("other colour", lambda: d.carabiner("0.1,0.3,0.65")),
        ],
        longer=(0, 12),
    ),
    u_scissor=part(
        d.scissor_half,
        (480, 52),
        True,
        [
            ("hole missing", lambda: d.scissor_half(False)),
            ("smaller ring", lambda: d.scissor_half(ring=6.5)),
        ],
        longer=(12, 40),
    ),
    u_ovalflange=part(
        d.oval_flange,
        (400, 56),
        False,
        [
            ("hole missing", lambda: d.oval_flange(d.OVAL_HOLES[:1])),
            ("hole moved", lambda: d.oval_flange(moved(d.OVAL_HOLES, 1, -4.5, 0))),
            ("smaller bore", lambda: d.oval_flange(bore=4.5)),
        ],
        sym=2,
    ),
)
