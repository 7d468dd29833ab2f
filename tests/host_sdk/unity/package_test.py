#!/usr/bin/env python3
"""The Unity package as make_package assembles it: manifest, .meta files, assemblies that compile by themselves.

usage: package_test.py --make MAKE_PACKAGE --mcs MCS --library LIBLIGHTWELL --license LICENSE --version VERSION
"""
import argparse
import json
import pathlib
import re
import subprocess
import sys
import tempfile
import unittest

options = None


class Package(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.folder = tempfile.TemporaryDirectory()
        cls.root = pathlib.Path(cls.folder.name) / "com.lightwell.sdk"
        cls.make("--plugin", f"linux-x86_64={options.library}")

    @classmethod
    def tearDownClass(cls):
        cls.folder.cleanup()

    @classmethod
    def make(cls, *arguments):
        return subprocess.run([options.make, cls.root, *arguments], check=True, capture_output=True, text=True)

    def test_the_manifest_names_what_is_there(self):
        manifest = json.loads((self.root / "package.json").read_text())
        self.assertRegex(manifest["name"], r"^[a-z0-9-]+(\.[a-z0-9-]+){2}$")
        self.assertEqual(manifest["version"], options.version)
        self.assertRegex(manifest["unity"], r"^\d{4}\.\d$")
        for sample in manifest["samples"]:
            self.assertTrue(list((self.root / sample["path"]).glob("*.cs")), sample)
        self.assertEqual((self.root / "LICENSE.md").read_text(), pathlib.Path(options.license).read_text())

    def test_each_asset_has_a_meta_file_with_a_guid_of_its_own(self):
        guids = {}
        for path in self.root.rglob("*"):
            name = path.relative_to(self.root)
            if path.suffix == ".meta":
                self.assertTrue(path.with_suffix("").exists(), f"{name} is of no asset")
                guids[name] = re.search(r"^guid: ([0-9a-f]{32})$", path.read_text(), re.MULTILINE)[1]
            elif not any(part.endswith("~") for part in name.parts):
                self.assertTrue(path.with_name(path.name + ".meta").is_file(), name)
        self.assertGreater(len(guids), 25)
        self.assertEqual(len(set(guids.values())), len(guids))
        self.make()
        again = re.search("guid: (.*)", (self.root / "Runtime/Managed/Lighting.cs.meta").read_text())[1]
        self.assertEqual(again, guids[pathlib.Path("Runtime/Managed/Lighting.cs.meta")])
        self.assertFalse((self.root / "Runtime/Plugins").exists())
        self.make("--plugin", f"linux-x86_64={options.library}")

    def test_the_plugin_is_for_its_platform_alone(self):
        plugin = self.root / "Runtime/Plugins/Linux/x86_64/liblightwell.so"
        self.assertEqual(plugin.read_bytes()[:4], b"\x7fELF")
        meta = plugin.with_name("liblightwell.so.meta").read_text()
        self.assertRegex(meta, r"Any:\n    second:\n      enabled: 0")
        self.assertRegex(meta, r"Standalone: Linux64\n    second:\n      enabled: 1")

    def test_each_assembly_compiles_with_its_references_alone(self):
        assemblies = {}
        for path in self.root.rglob("*.asmdef"):
            definition = json.loads(path.read_text())
            self.assertEqual(definition["name"], path.stem)
            self.assertTrue(definition["noEngineReferences"])
            assemblies[definition["name"]] = (path.parent, definition["references"])
        self.assertEqual(set(assemblies), {"Lightwell.Types", "Lightwell.Managed", "Lightwell.Native"})
        out = pathlib.Path(self.folder.name)
        for name in sorted(assemblies, key=lambda one: len(assemblies[one][1])):
            folder, references = assemblies[name]
            command = [options.mcs, "-langversion:7.2", "-warn:4", "-warnaserror", "-target:library",
                       f"-out:{out / name}.dll", *(f"-r:{out / one}.dll" for one in references), *folder.glob("*.cs")]
            done = subprocess.run(command, capture_output=True, text=True)
            self.assertEqual(done.returncode, 0, done.stderr)
            if name == "Lightwell.Managed":
                sources = "".join(source.read_text() for source in folder.glob("*.cs"))
                self.assertNotRegex(sources, r"DllImport|Marshal|IntPtr|unsafe")

    def test_wrong_usage(self):
        for arguments in (["--plugin", "amiga=x"], ["--plugin", "linux-x86_64=/nowhere.so"]):
            done = subprocess.run([options.make, pathlib.Path(self.folder.name) / "other", *arguments],
                                  capture_output=True, text=True)
            self.assertEqual(done.returncode, 2)
            self.assertIn("write PLATFORM=LIBRARY", done.stderr)
        done = subprocess.run([options.make, self.folder.name], capture_output=True, text=True)
        self.assertEqual(done.returncode, 2)
        self.assertIn("is not this package", done.stderr)


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    for name in ("make", "mcs", "library", "license", "version"):
        parser.add_argument(f"--{name}", required=True)
    options, rest = parser.parse_known_args()
    unittest.main(argv=[sys.argv[0], *rest])
