"""Builds the programs of board and host, and makes a board's disks from the arm64 sysroot
(cmake/sysroot_aarch64) and from hil/image.

Disks are ext4 file systems made by mke2fs -d, which needs neither root nor a loop device. All files belong to root.
"""

from __future__ import annotations

import gzip
import os
import re
import shutil
import subprocess
import tempfile
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from . import cache
from .processes import output_of
from .waits import say

REPOSITORY = Path(__file__).resolve().parents[2]
SOURCES = REPOSITORY / "hil/image"
# What makes Debian packages of a build (cmake/debian/README.md), and the install components of those that a board has.
PACKAGING = (REPOSITORY / "cmake/packaging.cmake", REPOSITORY / "cmake/debian")
COMPONENTS = ("daemon", "library", "tools")
# Parts of the sysroot that are only needed to compile.
NOT_ON_A_BOARD = ("usr/include", "usr/share/doc", "usr/share/perl", "usr/share/perl5", "usr/lib/aarch64-linux-gnu/perl",
                  "usr/lib/aarch64-linux-gnu/perl-base", "usr/share/cmake", "usr/lib/aarch64-linux-gnu/cmake",
                  "usr/share/initramfs-tools", "usr/lib/klibc", "usr/lib/gcc", "etc/rc0.d", "boot",
                  # The firmware's disk has dpkg's database: of the sysroot's packages none is installed.
                  "var/lib/dpkg")
HOST_TARGETS = ("lightwell_cli", "lightwelld", "lightwell-usb-camera", "demo_report", "compare_recordings",
                "marker_frames", "book_frames")


class ImageError(Exception):
    """A disk cannot be made; the text says why and what to do."""


def _run(*command: str | Path) -> str:
    return output_of(command, ImageError)


def sysroot() -> Path:
    """The arm64 sysroot; created if missing, which takes a minute and a half."""
    named = os.environ.get("LIGHTWELL_SYSROOT_AARCH64")
    if named:
        return Path(named)
    done = subprocess.run([REPOSITORY / "cmake/sysroot_aarch64"], stdout=subprocess.PIPE, text=True, check=False)
    if done.returncode != 0:
        raise ImageError("the arm64 sysroot cannot be made; see the output of cmake/sysroot_aarch64")
    return Path(done.stdout.strip())


class NotBuilt(Exception):
    """Configuring or building failed; the text has the last lines of the log and the log's path."""


def _run_logged(steps: Sequence[Sequence[str | Path]], log: Path) -> None:
    log.parent.mkdir(parents=True, exist_ok=True)
    with open(log, "w", encoding="utf-8") as out:
        for step in steps:
            words = [str(word) for word in step]
            if subprocess.run(words, cwd=REPOSITORY, stdin=subprocess.DEVNULL, stdout=out, stderr=out,
                              check=False).returncode:
                last = "\n".join(log.read_text(encoding="utf-8", errors="replace").splitlines()[-20:])
                raise NotBuilt(f"'{' '.join(words)}' failed:\n{last}\ncomplete log: {log}")


def build_for_board(folder: Path) -> None:
    """Builds into `folder`. Configures it anew if the sysroot has changed, because CMake's cache still refers to the
    old one."""
    packages = sysroot()
    steps: list[Sequence[str | Path]] = [["cmake", "--build", folder, "--target", "lightwell_installed"]]
    try:
        cached = (folder / "CMakeCache.txt").read_text(encoding="utf-8")
        in_use = f"LIGHTWELL_SYSROOT_IN_USE:INTERNAL={packages}\n" in cached
    except FileNotFoundError:
        in_use = False
    if not in_use:
        say("configuring and building the firmware for the board; this takes minutes the first time")
        steps.insert(0, ["cmake", "--fresh", "--preset", "board-aarch64", "-B", folder])
    _run_logged(steps, folder.parent / "board.log")


def build_for_host(folder: Path, panoramas: Path) -> None:
    """Builds into `folder` with the preset dev."""
    say("building the programs of the host")
    _run_logged([["cmake", "--preset", "dev", "-B", folder, f"-DLIGHTWELL_PANORAMA_DIR={panoramas}"],
          ["cmake", "--build", folder, "--target", *HOST_TARGETS]], folder.parent / "host.log")


@dataclass(frozen=True)
class Keys:
    """Private OpenSSH key files: `client` logs in as root, `host` identifies a board."""
    client: Path
    host: Path


def keys() -> Keys:
    """The two key pairs, created once on this machine; the public keys are beside them with the suffix .pub."""
    def make(folder: Path) -> None:
        for name in ("client", "host"):
            _run("ssh-keygen", "-q", "-t", "ed25519", "-N", "", "-C", f"lightwell-board-{name}", "-f", folder / name)

    folder = cache.kept("board-keys", "1", make)
    return Keys(folder / "client", folder / "host")


def _lines(path: Path) -> list[list[str]]:
    """The words of each line, without comments and empty lines."""
    words = (line.split("#")[0].split() for line in path.read_text(encoding="utf-8").splitlines())
    return [line for line in words if line]


def _replace(path: Path, text: str, mode: int = 0o644) -> None:
    """Writes a new file. The tree's files are hard links into the sysroot, which must not change."""
    path.parent.mkdir(parents=True, exist_ok=True)
    path.unlink(missing_ok=True)
    path.write_text(text, encoding="utf-8")
    path.chmod(mode)


def _link(path: Path, target: str) -> None:
    path.parent.mkdir(parents=True, exist_ok=True)
    path.unlink(missing_ok=True)
    path.symlink_to(target)


def add_accounts(root: Path, accounts: Path) -> None:
    """Writes passwd, group and shadow: Debian's fixed accounts and those of hil/image/accounts."""
    master = root / "usr/share/base-passwd"
    passwd = (master / "passwd.master").read_text(encoding="utf-8")
    members: dict[str, list[str]] = {}
    own = ""
    for name, number, home, *groups in _lines(accounts):
        own += f"{name}:x:{number}:\n"
        if home != "-":
            passwd += f"{name}:x:{number}:{number}::{home}:/usr/sbin/nologin\n"
        for group in groups:
            members.setdefault(group, []).append(name)
    lines = []
    for line in ((master / "group.master").read_text(encoding="utf-8") + own).splitlines():
        name, password, number, _ = line.split(":")
        lines.append(":".join((name, password, number, ",".join(members.pop(name, [])))))
    if members:
        raise ImageError(f"{accounts}: there is no group {', '.join(sorted(members))}")
    # No account has a password. It is marked by *, because ! would make sshd reject keys, too.
    passwd = re.sub(r"^([^:]*):\*:", r"\1:x:", passwd, flags=re.MULTILINE)
    names = [line.split(":")[0] for line in passwd.splitlines()]
    _replace(root / "etc/passwd", passwd)
    _replace(root / "etc/group", "\n".join(lines) + "\n")
    _replace(root / "etc/shadow", "".join(f"{name}:*:19000:0:99999:7:::\n" for name in names), 0o640)


def set_units(root: Path, units: Path) -> None:
    """Makes the links that systemctl would make for the lines of hil/image/units. A unit that does not exist is an
    error: its name is misspelt or its package is missing."""
    folders = (root / "etc/systemd/system", root / "usr/lib/systemd/system")
    own = folders[0]
    for verb, unit, *target in _lines(units):
        if verb == "silence":
            if not (root / "usr/lib/systemd/system-generators" / unit).exists():
                raise ImageError(f"{units}: there is no generator {unit}")
            _link(root / "etc/systemd/system-generators" / unit, "/dev/null")
            continue
        found = next((folder / unit for folder in folders if (folder / unit).exists()), None)
        if found is None:
            raise ImageError(f"{units}: there is no unit {unit}")
        if verb == "mask":
            _link(own / unit, "/dev/null")
        elif verb == "enable" and len(target) == 1:
            _link(own / f"{target[0]}.wants" / unit, "/" + str(found.relative_to(root)))
        else:
            raise ImageError(
                f"{units}: '{verb} {unit} {' '.join(target)}' is none of 'enable UNIT TARGET', 'mask UNIT' and "
                "'silence GENERATOR'"
            )
    _link(own / "default.target", "/usr/lib/systemd/system/multi-user.target")


def _fill_root(root: Path, packages: Path, known: Keys) -> None:
    """Fills `root` with the board's root file system: the packages' files, and what their scripts would have
    created."""
    # Hard links: a copy would take a gigabyte.
    _run("cp", "-al", f"{packages}/.", root)
    for name in NOT_ON_A_BOARD:
        if (root / name).exists():
            shutil.rmtree(root / name)
    _run("find", root / "usr/lib", "-name", "*.a", "-delete")
    for name in ("dev", "proc", "sys", "run", "tmp", "var/lib/lightwell"):
        (root / name).mkdir(parents=True, exist_ok=True)
    add_accounts(root, SOURCES / "accounts")
    for source in sorted((SOURCES / "root").rglob("*")):
        if source.is_file():
            _replace(root / source.relative_to(SOURCES / "root"), source.read_text(encoding="utf-8"))
    set_units(root, SOURCES / "units")
    _replace(root / "etc/ssh/ssh_host_ed25519_key", known.host.read_text(encoding="ascii"), 0o600)
    _replace(root / "etc/ssh/authorized_keys", known.client.with_suffix(".pub").read_text(encoding="ascii"))
    for name in ("hostname", "mtab"):
        (root / "etc" / name).unlink(missing_ok=True)
    if not (root / "etc/nsswitch.conf").exists():
        _replace(root / "etc/nsswitch.conf", (root / "usr/share/libc-bin/nsswitch.conf").read_text(encoding="utf-8"))
    for name, target in (("run", "/run"), ("lock", "/run/lock")):
        (root / "var" / name).rmdir()
        _link(root / "var" / name, target)
    # The owner's configuration is on the state disk. The link takes the place of the package's conffile.
    _link(root / "etc/lightwell", "/var/lib/lightwell/etc")
    _link(root / "usr/bin/awk", "mawk")
    _link(root / "usr/sbin/init", "/usr/lib/systemd/systemd")


def _kernel_version(root: Path) -> str:
    versions = sorted(path.name for path in (root / "usr/lib/modules").iterdir())
    if len(versions) != 1:
        raise ImageError(f"{root}/usr/lib/modules holds {versions or 'no kernel'} and must hold exactly one")
    return versions[0]


def _make_initrd(root: Path, version: str, initrd: Path) -> None:
    with tempfile.TemporaryDirectory() as name:
        work = Path(name)
        wanted: list[str] = []
        for module, in _lines(SOURCES / "modules"):
            for line in _run("modprobe", "-d", root, "-S", version, "--show-depends", module).splitlines():
                verb, path = line.split()[:2]
                if verb == "insmod" and path not in wanted:
                    wanted.append(path)
        inside = []
        for path in wanted:
            target = work / "lib" / Path(path).name
            target.parent.mkdir(exist_ok=True)
            shutil.copyfile(path, target)
            inside.append(f"/lib/{target.name}")
        (work / "modules").write_text("\n".join(inside) + "\n", encoding="ascii")
        (work / "bin").mkdir()
        shutil.copy(root / "usr/bin/busybox", work / "bin/busybox")
        (work / "bin/sh").symlink_to("busybox")
        for folder in ("dev", "proc", "sys"):
            (work / folder).mkdir()
        shutil.copy(SOURCES / "initrd_init", work / "init")
        (work / "init").chmod(0o755)
        packed = subprocess.run(["cpio", "-o", "-H", "newc", "--quiet", "-R", "0:0"], cwd=work, check=False,
                                input="\n".join(str(p.relative_to(work)) for p in sorted(work.rglob("*"))).encode(),
                                stdout=subprocess.PIPE, stderr=subprocess.PIPE)
        if packed.returncode != 0:
            raise ImageError(f"cpio failed: {packed.stderr.decode()}")
        initrd.write_bytes(gzip.compress(packed.stdout, 6))


def make_ext4(tree: Path, disk: Path, label: str, *, journal: bool, room_mb: float, inodes: int | None = None) -> None:
    """Makes the sparse file `disk`, an ext4 file system with the content of `tree` and `room_mb` MiB of free space.
    Files belong to root; if this process is root, to their owners in `tree`."""
    # By inode number, because a file may have several names.
    files = {entry.st_ino: entry for entry in (path.lstat() for path in tree.rglob("*"))}
    blocks = sum(-(-entry.st_size // 4096) for entry in files.values()) + len(files)
    megabytes = int(blocks * 4096 / 2**20 * 1.02 + len(files) * 256 / 2**20 + room_mb) + 2
    count = inodes or len(files) + len(files) // 10 + 64
    # In a user namespace, this user and its files are mapped to root.
    as_root = [] if os.geteuid() == 0 else ["unshare", "--map-root-user"]
    _run(*as_root, "mke2fs", "-q", "-F", "-t", "ext4", "-L", label, "-m", "0", "-N", str(count),
         "-E", "root_owner=0:0,lazy_itable_init=0", "-O", "has_journal" if journal else "^has_journal",
         "-d", tree, disk, f"{megabytes}M")


@dataclass(frozen=True)
class Base:
    """Kernel, initrd and root file system, all read-only."""
    kernel: Path
    initrd: Path
    disk: Path


def base() -> Base:
    """Kernel, initrd and root disk; made anew if one of their inputs has changed."""
    packages = sysroot()
    known = keys()

    def make(folder: Path) -> None:
        say("making the board's root disk, once (half a minute, 1.2 GB)")
        root = folder / "root"
        root.mkdir()
        _fill_root(root, packages, known)
        version = _kernel_version(root)
        shutil.copyfile(packages / f"boot/vmlinuz-{version}", folder / "vmlinuz")
        _run("depmod", "-b", root, version)
        _make_initrd(root, version, folder / "initrd")
        make_ext4(root, folder / "base.ext4", "lw-base", journal=False, room_mb=8)
        shutil.rmtree(root)

    # The folder's inode number: a sysroot that was made again has the same name and newer packages.
    key = cache.digest([packages.name, str(packages.stat().st_ino), SOURCES, Path(__file__),
                        known.client.with_suffix(".pub"), known.host.with_suffix(".pub")])
    folder = cache.kept("board-base", key, make)
    return Base(folder / "vmlinuz", folder / "initrd", folder / "base.ext4")


def _install_packages(build: Path, folder: Path, root: Path) -> None:
    """Makes Debian packages of `build` in `folder` and unpacks them by dpkg into `root`. Their scripts do not run, as
    those of no other package of the board: hil/image has the user, and enabling the service is a link."""
    components = ";".join(f"{name};{name}-debian" for name in COMPONENTS)
    _run("cpack", "--config", build / "CPackConfig.cmake", "-B", folder, "-D", f"CPACK_COMPONENTS_ALL={components}",
         "-D", "CPACK_DEBIAN_COMPRESSION_TYPE=gzip")
    for name in ("updates", "info"):
        (root / "var/lib/dpkg" / name).mkdir(parents=True)
    _replace(root / "var/lib/dpkg/status", "")
    _replace(root / "var/lib/dpkg/arch", "arm64\n")
    # The libraries that they depend on are in the base, where dpkg's database does not list them.
    _run("dpkg", f"--root={root}", "--force-not-root", "--force-bad-path", "--force-depends", "--force-architecture",
         "--unpack", *sorted(folder.glob("*.deb")))
    _link(root / "etc/systemd/system/multi-user.target.wants/lightwelld.service",
          "/usr/lib/systemd/system/lightwelld.service")


def firmware(build: Path) -> Path:
    """The disk that the board has below its base (hil/image/initrd_init): the Debian packages of `build`, and the
    panoramas of simulated cameras. Raises ImageError if the build is missing or incomplete."""
    if not (build / "CMakeCache.txt").exists():
        raise ImageError(f"{build} is not a configured build: run cmake --preset board-aarch64")
    panoramas = _run(REPOSITORY / "cmake/fetch_panoramas").strip()
    with tempfile.TemporaryDirectory(dir=cache.cache_root(), prefix=".board-stage.") as name:
        # Installing takes a second, packages take ten: they are made if something that is installed has changed. By
        # DESTDIR, because the installed unit contains the prefix.
        stage = Path(name) / "installed"
        for component in COMPONENTS:
            _run("env", f"DESTDIR={stage}", "cmake", "--install", build, "--component", component, "--strip",
                 "--prefix", "/usr")

        def make(folder: Path) -> None:
            say("making the board's packages and their disk (a quarter of a minute)")
            root = folder / "root"
            _install_packages(build, Path(name) / "packages", root)
            shutil.copytree(panoramas, root / "usr/local/share/lightwell/panoramas")
            make_ext4(root, folder / "firmware.ext4", "lw-firmware", journal=False, room_mb=1)
            shutil.rmtree(root)

        key = cache.digest([stage, *PACKAGING, Path(panoramas), Path(__file__)])
        return cache.kept("board-firmware", key, make) / "firmware.ext4"


def state(disk: Path, size_mb: int, config: str) -> None:
    """Makes a journaled disk with `size_mb` MiB of free space; it holds `config` as etc/probe.textproto, which is
    /etc/lightwell/probe.textproto on the board."""
    with tempfile.TemporaryDirectory() as name:
        tree = Path(name)
        (tree / "etc").mkdir()
        (tree / "etc/probe.textproto").write_text(config, encoding="utf-8")
        make_ext4(tree, disk, "lw-state", journal=True, room_mb=size_mb, inodes=4096)
