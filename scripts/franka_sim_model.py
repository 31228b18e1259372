"""Converts our Panda for franka-sim: heavier motors, and names for the shapes whose distances it monitors. python franka_sim_model.py PANDA_XML FOLDER"""
import pathlib, re, sys

text = pathlib.Path(sys.argv[1]).read_text()
folder = pathlib.Path(sys.argv[2])
# The gains of franka-sim, which are for another model, let our model overshoot its speed by a tenth.
text = text.replace('armature="0.1" damping="0.5"', 'armature="0.3" damping="0.5"')
# franka-sim expects one shape per link with this name; our shapes have no names, and no two of them touch.
for link in range(8):
    body = text.index(f'<body name="link{link}"')
    at = text.index('<geom class="panda collision"', body)
    text = text[:at] + f'<geom name="link{link}_collision"' + text[at + len("<geom"):]
(folder / "panda.xml").write_text(text)
pairs = "\n".join(
    f'<pair geom1="link{one}_collision" geom2="link{other}_collision" margin="0.05" gap="0.05"/>'
    for one in range(8) for other in range(one + 3, 8)
)
(folder / "fr3.xml").write_text(
    f'<mujoco model="fr3"><compiler angle="radian"/><option timestep="0.001"/><include file="panda.xml"/>'
    f"<contact>\n{pairs}\n</contact></mujoco>\n"
)
