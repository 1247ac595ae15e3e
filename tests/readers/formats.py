"""formats.py MESH.vtu MESH.msh PROBLEM.feb PROBLEM.inp: the same mesh in four formats, point by point,
tetrahedron by tetrahedron and set by set; .vtu, .msh and .inp as meshio reads them, .feb by its XML.
With linear or quadratic elements; the displacement where a file holds one."""

import sys
import xml.etree.ElementTree as ElementTree

import meshio
import numpy as np
from grids import check

TAGS = {1: "skin", 2: "chest_wall", 3: "cut"}
# FEBio 4 reads the sections in this order (FEBio User Manual, "Free Format Input").
SECTIONS = ["Module", "Control", "Globals", "Material", "Mesh", "MeshDomains", "Boundary", "Loads",
            "LoadData", "Output"]
TETS = ("tetra", "tetra10")
FACES = ("triangle", "triangle6")
# Faces S1 to S4 of an Abaqus tetrahedron.
SIDES = {"S1": (0, 1, 2), "S2": (0, 3, 1), "S3": (1, 3, 2), "S4": (2, 3, 0)}


def cells(mesh, kinds):
    """All cells of a kind, and the places of their blocks."""
    blocks = [n for n, block in enumerate(mesh.cells) if block.type in kinds]
    return np.concatenate([mesh.cells[n].data for n in blocks]), blocks


def corners(faces):
    """Faces as a set of sorted corners."""
    return {tuple(face) for face in np.sort(np.asarray(faces)[:, :3], axis=1).tolist()}


def same(name, found, wanted):
    check(found.shape == wanted.shape and np.array_equal(found, wanted), f"{name} differ")


vtu = meshio.read(sys.argv[1])
tets, _ = cells(vtu, TETS)
faces, blocks = cells(vtu, FACES)
tags = np.concatenate([np.ravel(vtu.cell_data["boundary"][n]) for n in blocks]).astype(int)
tagged = {name: corners(faces[tags == tag]) for tag, name in TAGS.items()}
nodes = {name: np.unique(faces[tags == tag]) for tag, name in TAGS.items()}

# Gmsh
msh = meshio.read(sys.argv[2])
same("msh: points", msh.points, vtu.points)
same("msh: tetrahedra", cells(msh, TETS)[0], tets)
check({name: group.tolist() for name, group in msh.field_data.items()}
      == {**{name: [tag, 2] for tag, name in TAGS.items()}, "soft_tissue": [4, 3]},
      f"msh: groups {msh.field_data}")
found, blocks = cells(msh, FACES)
group = np.concatenate([msh.cell_data["gmsh:physical"][n] for n in blocks])
for tag, name in TAGS.items():
    check(corners(found[group == tag]) == tagged[name], f"msh: the faces {name} differ")
_, blocks = cells(msh, TETS)
check(all((msh.cell_data["gmsh:physical"][n] == 4).all() for n in blocks), "msh: soft_tissue")
if "displacement" in vtu.point_data:
    same("msh: displacements", msh.point_data["displacement"], vtu.point_data["displacement"])

# FEBio
root = ElementTree.parse(sys.argv[3]).getroot()
check(root.tag == "febio_spec" and root.get("version") == "4.0", f"feb: {root.tag} {root.attrib}")
check([section.tag for section in root] == SECTIONS, f"feb: {[s.tag for s in root]}")
check(root.findtext("Module/units") == "mm-kg-s", "feb: units")


def numbers(text):
    return [int(n) - 1 for n in text.split(",")]


feb = root.find("Mesh")
ids = [int(node.get("id")) for node in feb.find("Nodes")]
check(ids == list(range(1, len(ids) + 1)), "feb: node numbers")
same("feb: points", np.array([[float(c) for c in n.text.split(",")] for n in feb.find("Nodes")]),
     vtu.points)
part = feb.find("Elements")
check(part.get("type") == f"tet{tets.shape[1]}", f"feb: elements {part.get('type')}")
same("feb: tetrahedra", np.array([numbers(e.text) for e in part]), tets)
for name in TAGS.values():
    same(f"feb: nodes {name}", np.array(numbers(feb.find(f"NodeSet[@name='{name}']").text)),
         nodes[name])
    surface = feb.find(f"Surface[@name='{name}']")
    check({face.tag for face in surface} == {f"tri{faces.shape[1]}"}, f"feb: faces of {name}")
    check(corners([numbers(f.text) for f in surface]) == tagged[name], f"feb: faces {name} differ")
material = root.find("Material/material")
domain = root.find("MeshDomains/SolidDomain")
check((domain.get("name"), domain.get("mat")) == (part.get("name"), material.get("name")),
      "feb: the domain has no elements or material")
check(material.get("type") == "neo-Hookean", f"feb: material {material.get('type')}")
for held in root.find("Boundary"):
    check(held.get("node_set") in nodes and held.get("type") == "zero displacement", "feb: held")
    check([dof.text for dof in held] == ["1", "1", "1"], "feb: held in part")
check("chest_wall" in {held.get("node_set") for held in root.find("Boundary")}, "feb: chest wall")
load = root.find("Loads/body_load/force")
controllers = {c.get("id") for c in root.find("LoadData")}
check(load.get("lc") in controllers, "feb: the load has no curve")

# Abaqus: written to 1e-10 mm, since CalculiX reads 20 characters of a number.
inp = meshio.read(sys.argv[4])
off = np.abs(inp.points - vtu.points).max()
check(inp.points.shape == vtu.points.shape and off <= 5.1e-11, f"inp: points {off:.3g} mm off")
same("inp: tetrahedra", cells(inp, TETS)[0], tets)
for name in TAGS.values():
    same(f"inp: nodes {name}", np.sort(inp.point_sets[name]), nodes[name])
    found = []
    for side, of in SIDES.items():
        for block, members in zip(inp.cells, inp.cell_sets.get(f"{name}_s{side[1]}", [[]])):
            found += block.data[np.asarray(members, dtype=int)][:, of].tolist()
    check(corners(found) == tagged[name] and len(found) == len(tagged[name]),
          f"inp: the surface {name} differs")
text = open(sys.argv[4], encoding="utf-8").read()
gravity = np.array([float(n) for n in text.split("GRAV,")[1].split("\n")[0].split(",")])
pull = -np.array([float(c) for c in load.text.split(",")])
check(np.abs(gravity[0] * gravity[1:] - pull).max() < 1e-6, "feb and inp have another load")
density = float(text.split("*DENSITY\n")[1].split("\n")[0])
check(np.isclose(density, float(material.findtext("density")), rtol=1e-9), "density")
shear = float(material.findtext("E")) / 2 / (1 + float(material.findtext("v")))
c10 = float(text.split("*HYPERELASTIC, NEO HOOKE\n")[1].split(",")[0])
check(np.isclose(2 * c10, shear, rtol=1e-9), "shear modulus")
print(f"{len(tets)} tetrahedra of {tets.shape[1]} nodes, {len(vtu.points)} points in four formats")
