#!/usr/bin/env python3
"""Writes three_blocks.* for the tests of flexarm-fe-io: one small mesh in every Gmsh layout.

The files are in crates/links/flexarm-fe-io/tests/data.

Three separate blocks of 1 x 1 x 1 m side by side along x, second order, straight edges: tetrahedra
(`tets`, x = 0 to 1), hexahedra (`hexes`, x = 2 to 3) and wedges (`wedges`, x = 4 to 5). Groups: the
faces x = 0 (`left`) and x = 5 (`right`), one edge of the first block (`rim`), its first corner
(`corner`).

Run with the gmsh package (made with 4.15.2): python tools/make_mesh_fixtures.py
"""
import os
import pathlib

import gmsh

FOLDER = pathlib.Path(__file__).resolve().parent.parent / "crates/links/flexarm-fe-io/tests/data"


def block(x, size, recombine=False, layers=0):
    """Creates a unit cube at x, extruded if it has layers. Returns its volume."""
    geo = gmsh.model.occ
    if layers == 0:
        return geo.addBox(x, 0, 0, 1, 1, 1)
    face = geo.addRectangle(x, 0, 0, 1, 1)
    swept = geo.extrude([(2, face)], 0, 0, 1, numElements=[layers], recombine=True)
    geo.synchronize()
    if recombine:
        gmsh.model.mesh.setTransfiniteSurface(face)
        gmsh.model.mesh.setRecombine(2, face)
    return next(tag for dim, tag in swept if dim == 3)


def entity_at(dim, low, high):
    """Returns the single entity of a dimension inside a box."""
    found = gmsh.model.getEntitiesInBoundingBox(*[v - 1e-3 for v in low], *[v + 1e-3 for v in high], dim)
    assert len(found) == 1, found
    return found[0][1]


def main():
    gmsh.initialize()
    gmsh.option.setNumber("General.Terminal", 0)
    volumes = {
        "tets": block(0, 1.0),
        "hexes": block(2, 1.0, recombine=True, layers=1),
        "wedges": block(4, 1.0, layers=1),
    }
    gmsh.model.occ.synchronize()
    for name, tag in volumes.items():
        gmsh.model.addPhysicalGroup(3, [tag], name=name)
    gmsh.model.addPhysicalGroup(2, [entity_at(2, (0, 0, 0), (0, 1, 1))], name="left")
    gmsh.model.addPhysicalGroup(2, [entity_at(2, (5, 0, 0), (5, 1, 1))], name="right")
    gmsh.model.addPhysicalGroup(1, [entity_at(1, (0, 0, 0), (0, 0, 1))], name="rim")
    gmsh.model.addPhysicalGroup(0, [entity_at(0, (0, 0, 0), (0, 0, 0))], name="corner")

    gmsh.option.setNumber("Mesh.MeshSizeMin", 1.0)
    gmsh.option.setNumber("Mesh.MeshSizeMax", 1.0)
    gmsh.option.setNumber("Mesh.ElementOrder", 2)
    gmsh.option.setNumber("Mesh.SecondOrderIncomplete", 1)
    gmsh.model.mesh.generate(3)

    FOLDER.mkdir(parents=True, exist_ok=True)
    os.chdir(FOLDER)  # the .inp contains the given path in its heading
    for version, label in ((2.2, "v22"), (4.1, "v41")):
        gmsh.option.setNumber("Mesh.MshFileVersion", version)
        for binary, kind in ((0, "ascii"), (1, "binary")):
            gmsh.option.setNumber("Mesh.Binary", binary)
            gmsh.write(f"three_blocks_{label}_{kind}.msh")
    gmsh.option.setNumber("Mesh.SaveGroupsOfNodes", 1)
    gmsh.write("three_blocks.inp")
    gmsh.finalize()


if __name__ == "__main__":
    main()
