#!/usr/bin/env python3
"""The Debian packages of a build: content, dependencies, installation, use, removal.

usage: debian_packages_test.py CMAKE BUILD [PACKAGES]

Packages are made of BUILD unless PACKAGES is given: a folder of packages for this machine's architecture that were made
of BUILD. Exits with 77 and the reason, after the tests that need no root, if packages cannot be installed in a private
root here.
"""
import os
import re
import shutil
import subprocess
import sys
import tempfile
import unittest
from pathlib import Path

from private_root import PrivateRoot, enter_mount_namespace, output_of

CMAKE, BUILD = sys.argv[1], Path(sys.argv[2])
HERE = Path(__file__).resolve().parent
NAMES = {"lightwelld", "liblightwell1", "liblightwell-dev", "lightwell-tools", "python3-lightwell"}
# Files that only packages have, besides documents.
ADDED = {"/etc/lightwell/probe.textproto", "/usr/lib/udev/rules.d/70-lightwell.rules"}
PROGRAMS = ["lightwelld", "lightwell", "lightwell-estimate", "lightwell-eval", "lightwell-calibrate",
            "lightwell_plot.py", "lightwell-usb-gadget"]
PROGRAMS += [name for name in ("ar_viewer", "lightwell-field", "lightwell-object") if (BUILD / "bin" / name).exists()]
cannot_install = ""
packages: dict[str, Path] = {}  # by name
lintian: subprocess.Popen | None = None


def setUpModule():
    if len(sys.argv) > 3:
        folder = Path(sys.argv[3])
    else:
        folder = Path(unittest.enterModuleContext(tempfile.TemporaryDirectory()))
        # gzip: a third of the time of xz.
        output_of(Path(CMAKE).with_name("cpack"), "--config", BUILD / "CPackConfig.cmake", "-B", folder,
                  "-D", "CPACK_DEBIAN_COMPRESSION_TYPE=gzip")
    packages.update({path.name.split("_")[0]: path for path in folder.glob("*.deb")})
    if shutil.which("lintian"):  # Runs beside the tests.
        global lintian
        lintian = subprocess.Popen(["lintian", "--fail-on", "error", "--tag-display-limit", "0", *packages.values()],
                                   text=True, stdout=subprocess.PIPE, stderr=subprocess.STDOUT)
        unittest.addModuleCleanup(lintian.kill)


def field(package: Path, name: str) -> str:
    return output_of("dpkg-deb", "--field", package, name).strip()


def files_of(package: Path) -> set[str]:
    """Files and symbolic links of a package."""
    lines = output_of("dpkg-deb", "--contents", package).splitlines()
    return {line.split(" -> ")[0].split(maxsplit=5)[5][1:] for line in lines if line[0] != "d"}


def files_below(folder: Path) -> set[str]:
    return {"/" + str(path.relative_to(folder)) for path in folder.rglob("*") if path.is_symlink() or path.is_file()}


class Packages(unittest.TestCase):
    def test_there_are_five_of_one_version(self):
        self.assertEqual(set(packages), NAMES)
        version = field(packages["lightwelld"], "Version")
        for name, path in packages.items():
            with self.subTest(name):
                self.assertEqual(field(path, "Version"), version)
                native = output_of("dpkg", "--print-architecture").strip()
                self.assertEqual(field(path, "Architecture"), "all" if name == "python3-lightwell" else native)
                depends = field(path, "Depends").split(", ")
                if name in ("liblightwell-dev", "lightwell-tools", "python3-lightwell"):
                    self.assertIn(f"liblightwell1 (= {version})", depends)
                self.assertNotIn("liblightwell1", [word.split()[0] for word in depends if "=" not in word])

    def test_each_installed_file_is_in_exactly_one_package(self):
        with tempfile.TemporaryDirectory() as name:
            output_of(CMAKE, "--install", BUILD, "--prefix", "/usr", env=os.environ | {"DESTDIR": name})
            installed = files_below(Path(name))
        packaged = [path for package in packages.values() for path in files_of(package)]
        self.assertEqual(len(packaged), len(set(packaged)), "a file is in two packages")
        documents = ("/usr/share/doc/", "/usr/share/lintian/")
        added = {path for path in set(packaged) - installed if not path.startswith(documents)}
        self.assertEqual(added, ADDED)
        self.assertEqual(installed - set(packaged), set())

    def test_the_library_tells_others_its_package_and_asks_for_ldconfig(self):
        library = packages["liblightwell1"]
        shlibs = f"liblightwell 1 liblightwell1 (>= {field(library, 'Version')})\n"
        self.assertEqual(output_of("dpkg-deb", "--info", library, "shlibs"), shlibs)
        self.assertEqual(output_of("dpkg-deb", "--info", library, "triggers"), "activate-noawait ldconfig\n")

    def test_avahis_library_which_the_sdk_loads_is_recommended_and_not_required(self):
        for name in ("liblightwell1", "lightwell-tools"):
            with self.subTest(name):
                self.assertIn("libavahi-client3", field(packages[name], "Recommends").split(", "))
                self.assertNotIn("libavahi-client3", field(packages[name], "Depends"))
        self.assertNotIn("avahi", field(packages["liblightwell-dev"], "Depends"))

    def test_zz_lintian_finds_no_error(self):
        if lintian is None:
            self.skipTest("lintian is not installed")
        found, _ = lintian.communicate()
        self.assertEqual(lintian.returncode, 0, found)

    def test_each_override_has_a_reason(self):
        for file in (HERE.parents[1] / "cmake/debian").rglob("lintian-overrides"):
            lines = file.read_text(encoding="utf-8").splitlines()
            for above, line in zip(["", *lines], lines):
                self.assertTrue(line.startswith("#") or above.startswith("#"), f"{file}: {line}")


class Installed(unittest.TestCase):
    """The packages in a private root with this machine's packages."""

    @classmethod
    def setUpClass(cls):
        if cannot_install:
            raise unittest.SkipTest(cannot_install)
        cls.root = cls.enterClassContext(PrivateRoot())
        cls.path = cls.root.path
        folder = cls.path / "tmp/packages"
        folder.mkdir()
        for package in packages.values():
            shutil.copy(package, folder)
        cls.debs = [f"/tmp/packages/{path.name}" for path in sorted(folder.iterdir())]
        cls.before = cls.own_files()
        cls.root.run("apt-get", "install", "--simulate", *cls.debs)
        cls.root.run("dpkg", "--install", *cls.debs)

    @classmethod
    def own_files(cls):
        """Files and folders whose names are the project's, except in dpkg's database."""
        folders = (cls.path / name for name in ("etc", "usr", "var/lib"))
        found = output_of("find", *folders, "-name", "*lightwell*").splitlines()
        return {path for path in found if "/dpkg/" not in path}

    def test_a_programs_start(self):
        for program in PROGRAMS:
            with self.subTest(program):
                self.root.run(program, "--help")

    def test_a_python_receives_light_from_the_daemon_as_the_user_of_the_service(self):
        shutil.copytree(os.environ["LIGHTWELL_PANORAMA_DIR"], self.path / "tmp/panoramas")
        command = self.root.command("setpriv", "--reuid=lightwell", "--regid=lightwell", "--init-groups",
                                    "env", "LIGHTWELL_PANORAMA_DIR=/tmp/panoramas",
                                    "lightwelld", "--camera", "sim:studio", "--size", "160x120",
                                    "--listen", "127.0.0.1:0")
        with subprocess.Popen(command, text=True, stdout=subprocess.PIPE, stderr=subprocess.PIPE) as daemon:
            try:
                listening = daemon.stdout.readline()
                self.assertIn("grpc://", listening, "" if listening else daemon.stderr.read())
                address = re.search("grpc://[0-9.:]+", listening)[0]
                ask = ("import lightwell\n"
                       f"light = lightwell.connect('{address}').wait_for_next(timeout=20)\n"
                       "print(lightwell.__file__, light.irradiance((0, 1, 0)).value.min() > 0)")
                self.assertEqual(self.root.run("python3", "-c", ask),
                                 "/usr/lib/python3/dist-packages/lightwell/__init__.py True\n")
                self.assertIn("sim:studio", self.root.run("lightwell", "info", address))
            finally:
                daemon.terminate()
                daemon.communicate()

    def test_a_the_service_waits_for_its_owner(self):
        unit = (self.path / "usr/lib/systemd/system/lightwelld.service").read_text()
        self.assertIn("\nExecStart=/usr/bin/lightwelld ", unit)
        state = subprocess.run(self.root.command("systemctl", "is-enabled", "lightwelld"), check=False, text=True,
                               capture_output=True)
        self.assertEqual(state.stdout, "disabled\n", state.stderr)

    def test_a_applications_build_against_the_packages_alone(self):
        for name in ("consumer", "c_consumer"):
            shutil.copytree(HERE / name, self.path / "tmp" / name)
            self.root.run("cmake", "-S", f"/tmp/{name}", "-B", f"/tmp/{name}/build",
                          "-DCMAKE_FIND_USE_PACKAGE_REGISTRY=OFF")
            self.root.run("cmake", "--build", f"/tmp/{name}/build")
            self.assertRegex(self.root.run(f"/tmp/{name}/build/{name}"), r"^lightwell \d+\.\d+\.\d+\n$")
        self.root.run("sh", "-c", "cc -o /tmp/by_pkg_config /tmp/c_consumer/main.c "
                                  "$(pkg-config --cflags --libs lightwell)")
        self.assertRegex(self.root.run("/tmp/by_pkg_config"), r"^lightwell \d+\.\d+\.\d+\n$")
        include = self.root.run("pkg-config", "--variable=includedir", "lightwell").strip()
        self.assertEqual(os.path.normpath(include), "/usr/include")
        self.assertEqual(self.libraries_without_a_dependency("/tmp/consumer/build/consumer"), set())

    def libraries_without_a_dependency(self, program):
        """Libraries that `program` was linked to whose development package is no dependency of liblightwell-dev."""
        depends, provided = {}, {}
        form = "${Package}\t${Depends}, ${Pre-Depends}\t${Provides}\n"
        for line in re.sub(r"\([^)]*\)|:any", "", self.root.run("dpkg-query", "-W", "-f", form)).splitlines():
            package, needs, provides = line.split("\t")
            depends[package] = re.split(r"[ ,|]+", needs)
            for name in re.split(r"[ ,]+", provides):
                provided.setdefault(name, []).append(package)
        closure, ends = set(), ["liblightwell-dev", "g++"]
        while ends:
            name = ends.pop()
            if name and name not in closure:
                closure.add(name)
                ends += depends.get(name, []) + provided.get(name, [])
        missing = set()
        for soname in re.findall(r"NEEDED.*\[(.*)\]", self.root.run("readelf", "-d", program)):
            search = self.root.command("dpkg-query", "--search", f"*/{soname.split('.so')[0]}.so")
            found = subprocess.run(search, check=False, capture_output=True, text=True).stdout
            owners = {line.split(":")[0] for line in found.splitlines()}
            if owners and not owners & closure:
                missing.add(f"{soname}: {sorted(owners)}")
        return missing

    def test_b_an_upgrade_keeps_the_owners_configuration(self):
        configuration = self.path / "etc/lightwell/probe.textproto"
        configuration.write_text(configuration.read_text() + "# the owner's\n")
        self.root.run("dpkg", "--install", *self.debs)
        self.assertTrue(configuration.read_text().endswith("# the owner's\n"))

    def test_c_purging_leaves_nothing_and_can_be_repeated(self):
        (self.path / "var/lib/lightwell/keys").mkdir(parents=True, exist_ok=True)
        scripts = {path.name: path.read_text() for path in (self.path / "var/lib/dpkg/info").glob("*lightwell*.p*")}
        self.assertIn("lightwelld.postrm", scripts)
        self.root.run("dpkg", "--remove", *NAMES)
        self.assertTrue((self.path / "etc/lightwell/probe.textproto").exists())
        self.root.run("dpkg", "--purge", *NAMES)
        self.assertEqual(self.own_files() - self.before, set())
        for name, text in sorted(scripts.items()):
            script = self.path / "tmp" / name
            script.write_text(text)
            script.chmod(0o755)
            argument = {"prerm": "remove", "postrm": "purge"}.get(name.rsplit(".", 1)[1])
            if argument:
                for _ in range(2):
                    self.root.run(f"/tmp/{name}", argument)


if __name__ == "__main__":
    cannot_install = enter_mount_namespace()
    result = unittest.main(argv=sys.argv[:1], exit=False).result
    if result.wasSuccessful() and cannot_install:
        print(f"not installed: {cannot_install}")
        sys.exit(77)
    sys.exit(not result.wasSuccessful())
