#!/usr/bin/env python3
"""Tests the recipes of host_sdk/recipes against CMakeLists.txt. usage: recipes.py --root DIR"""

import argparse
import ast
import json
import re
import sys
import unittest
from pathlib import Path


class Recipes(unittest.TestCase):
    root: Path

    def setUp(self) -> None:
        self.cmake = (self.root / "CMakeLists.txt").read_text(encoding="utf-8")
        self.parts = set(re.search(r"set\(optional_parts ([^)]+)\)", self.cmake)[1].split())
        self.recipes = self.root / "host_sdk/recipes"

    def test_the_port_has_the_version_of_the_project(self) -> None:
        port = json.loads((self.recipes / "vcpkg/lightwell/vcpkg.json").read_text(encoding="utf-8"))
        self.assertIn(f"project(lightwell VERSION {port['version']} ", self.cmake)
        self.assertEqual(set(port["default-features"]), set(port["features"]))

    def test_the_port_leaves_out_parts_that_there_are(self) -> None:
        text = (self.recipes / "vcpkg/lightwell/portfile.cmake").read_text(encoding="utf-8")
        always = re.search(r"set\(without ([^)]+)\)", text)[1].split()
        optional = re.search(r"foreach\(part IN ITEMS ([^)]+)\)", text)[1].split()
        port = json.loads((self.recipes / "vcpkg/lightwell/vcpkg.json").read_text(encoding="utf-8"))
        self.assertLessEqual(set(always) | set(optional), self.parts)
        self.assertEqual(set(optional) | {"grpc"}, set(port["features"]))

    def test_the_conan_recipe_parses_and_its_options_are_parts(self) -> None:
        tree = ast.parse((self.recipes / "conan/conanfile.py").read_text(encoding="utf-8"))
        kind = next(node for node in tree.body if isinstance(node, ast.ClassDef))
        options = next(ast.literal_eval(node.value) for node in kind.body
                       if isinstance(node, ast.Assign) and node.targets[0].id == "options")
        self.assertLessEqual(set(options) - {"dependencies", "grpc"}, self.parts)
        ast.parse((self.recipes / "conan/test_package/conanfile.py").read_text(encoding="utf-8"))


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--root", type=Path, required=True)
    Recipes.root = parser.parse_args().root
    sys.exit(not unittest.main(argv=sys.argv[:1], exit=False).result.wasSuccessful())
