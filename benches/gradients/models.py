"""The models that are compared: those of `vibrissa verify` (src/census/configuration.rs), as keywords of `vibrissa.strain`."""

import rod

NEO = dict(material={"neo-hookean": 3.2}, surface=True, shear=True, extension=True)
MOONEY = {"mooney-rivlin": [0.35, 0.15]}
YEOH = {"yeoh": [0.5, -0.08, 0.02]}
SHEARED = dict(shear=True, extension=True)
POLE = dict(surface=True, shear=True, pole_radius=3.0, material={"neo-hookean": 3.2})
COULOMB = dict(contact={"coulomb": 0.3}, material=MOONEY, surface=True, shear=True, extension=True)
STICK = dict(NEO, contact="stick")
SOLID = dict(NEO, clamp="bonded", indentation=True, section="distorting", pole_radius=3.0)
LINEAR = dict(geometry="linear")
FOIL = dict(foil={"stiffness": 100.0, "length": 6.3, "width": 2.8})
ROOT = {"k_theta": 500.0, "k_y": 20.0, "k_x": 20.0}
FAR, BEHIND, PASSIVE = dict(side="far"), dict(hub=10.0), dict(displaced=True)
TILTED = dict(second=True, tilted=True)

MODELS = {
    "linear": LINEAR,
    "linear-shear": dict(LINEAR, shear=True),
    "linear-hub": dict(LINEAR, shear=True, **BEHIND),
    "linear-passive": dict(LINEAR, shear=True, **PASSIVE),
    "linear-tilted": dict(LINEAR, **TILTED),
    "hooke": {},
    "surface": dict(surface=True),
    "timoshenko": SHEARED,
    "neo": NEO,
    "mooney-coulomb": COULOMB,
    "stick": STICK,
    "pole-far": dict(POLE, **FAR),
    "yeoh": dict(SHEARED, surface=True, material=YEOH),
    "shear": dict(shear=True, nu=0.3),
    "extension": dict(extension=True),
    "extension-far": dict(extension=True, **FAR),
    "pole": dict(pole_radius=3.0),
    "coulomb": dict(extension=True, contact={"coulomb": 0.3}),
    "sticking": dict(extension=True, contact="stick"),
    "neo-alone": dict(material={"neo-hookean": 3.2}),
    "mooney-alone": dict(material=MOONEY),
    "yeoh-alone": dict(material=YEOH, **FAR),
    "softening": dict(extension=True, material={"yeoh": [0.5, -0.3, 0.0]}),
    "coulomb-zero": dict(surface=True, extension=True, contact={"coulomb": 0.0}),
    "coulomb-huge": dict(surface=True, extension=True, contact={"coulomb": 1000.0}),
    "hooke-hub": BEHIND,
    "timoshenko-hub": dict(SHEARED, **BEHIND),
    "neo-hub": dict(NEO, **BEHIND),
    "mooney-coulomb-hub": dict(COULOMB, **BEHIND),
    "stick-hub": dict(STICK, **BEHIND),
    "hooke-passive": PASSIVE,
    "neo-passive": dict(NEO, **PASSIVE),
    "mooney-coulomb-passive": dict(COULOMB, **PASSIVE),
    "stick-passive": dict(STICK, **PASSIVE),
    "pole-far-passive": dict(POLE, **FAR, **PASSIVE),
    "hooke-tilted": TILTED,
    "timoshenko-tilted": dict(SHEARED, **TILTED),
    "neo-tilted": dict(NEO, **TILTED),
    "pole-far-tilted": dict(POLE, **FAR, **TILTED),
    "sticking-tilted": dict(extension=True, contact="stick", **TILTED),
    "neo-hub-tilted": dict(NEO, **BEHIND, **TILTED),
    "neo-passive-tilted": dict(NEO, **PASSIVE, **TILTED),
    "root": dict(SHEARED, root=ROOT),
    "power": dict(SHEARED, exponent=2.0, **FAR),
    "hollow": dict(SHEARED, surface=True, bore=[[0.0, 0.2], [5.0, 0.1]]),
    "cored": dict(SHEARED, core={"diameter": 0.02, "modulus": 6e4}),
    "curved": dict(SHEARED, curvature=2e-3, curvature_slope=-1e-5),
    "curved-neo-passive": dict(SHEARED, material={"neo-hookean": 3.2}, curvature=2e-3, curvature_slope=-1e-5, **PASSIVE),
    "moment": dict(curvature=-2e-3, root=ROOT, signal="moment"),
    "clamp": dict(clamp=0.05),
    "socket": dict(clamp="socket", shear=True, nu=0.45),
    "solid": SOLID,
    "solid-far-hub": dict(SOLID, **FAR, **BEHIND),
    "solid-passive": dict(SOLID, **PASSIVE),
    "foil": FOIL,
    "solid-foil-far": dict(SOLID, **FOIL, **FAR),
    "glued": dict(clamp="glued", shear=True),
    "glued-stick": dict(STICK, clamp="glued"),
    "socket-tilted": dict(NEO, clamp="socket", **TILTED),
    "indentation": dict(indentation=True, pole_radius=3.0, surface=True),
    "distorting": dict(section="distorting"),
}

LAWS = {"hooke": rod.HOOKE, "neo-hookean": rod.NEO, "mooney-rivlin": rod.MOONEY, "yeoh": rod.YEOH}
CLAMPS = {"bonded": 1, "glued": 2, "socket": 3}
MODULI = {rod.HOOKE: ["E"], rod.NEO: ["E"], rod.MOONEY: ["C10", "C01"], rod.YEOH: ["C10", "C20", "C30"]}
# Names in `grad` that differ from those in `NUMBERS`.
INPUTS = {"bore": "inside", "core.diameter": "inside", "theta": "drive", "delta": "drive"}
# Per degree.
DEGREES = ("theta", "tilt", "lean")


def described(model):
    """Keywords of `vibrissa.strain`, numbers that all taps share, and switches."""
    keywords = {key: value for key, value in model.items() if key not in ("displaced", "tilted")}
    law, moduli = next(iter(model.get("material", {"hooke": 3.2}).items()))
    contact = model.get("contact", "frictionless")
    clamp = model.get("clamp", "rigid")
    keywords.setdefault("material", {law: moduli})
    numbers = dict(nu=model.get("nu", 0.5), hub=model.get("hub", 0.0), pole_radius=model.get("pole_radius", 0.0), exponent=model.get("exponent", 1.0))
    numbers |= dict(zip(MODULI[LAWS[law]], moduli if isinstance(moduli, list) else [moduli]))
    if isinstance(contact, dict):
        numbers["mu"] = contact["coulomb"]
    if isinstance(clamp, float):
        numbers["clamp"] = clamp
    for section in ("foil", "root"):
        numbers |= {f"{section}.{key}": value for key, value in model.get(section, {}).items()}
    inner = model.get("bore") or "core" in model
    if "bore" in model:
        (numbers["s_0"], numbers["i_0"]), (numbers["s_1"], numbers["i_1"]) = model["bore"]
    if "core" in model:
        numbers |= {"core.modulus": model["core"]["modulus"], "s_0": -1.0, "s_1": 1e6, "i_0": model["core"]["diameter"], "i_1": model["core"]["diameter"]}
    numbers |= {key: model.get(key, 0.0) for key in ("curvature", "curvature_slope")}
    on = dict(displaced=model.get("displaced"), surface=model.get("surface"), shear=model.get("shear"), extension=model.get("extension"), law=LAWS[law],
              far=model.get("side") == "far", built=any(key in model for key in ("root", "exponent", "bore", "core", "curvature")), power="exponent" in model, inner=bool(inner),
              moment=model.get("signal") == "moment", tilted=model.get("tilted"), clamp=CLAMPS.get(clamp, 4) if clamp != "rigid" else 0,
              indentation=model.get("indentation"), distorting=model.get("section") == "distorting", foil="foil" in model, root="root" in model,
              linear=model.get("geometry") == "linear", second=model.get("second"), coulomb=False, free=contact == "frictionless")
    return keywords, numbers, [int(on[name] or 0) for name in rod.SWITCHES]
