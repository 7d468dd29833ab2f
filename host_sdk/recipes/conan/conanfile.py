"""Conan 2 recipe of the host SDK, from this source tree: conan create host_sdk/recipes/conan --build=missing"""

import re
from pathlib import Path

from conan import ConanFile
from conan.errors import ConanInvalidConfiguration
from conan.tools.build import check_min_cppstd
from conan.tools.cmake import CMake, CMakeDeps, CMakeToolchain
from conan.tools.files import copy, rmdir
from conan.tools.gnu import PkgConfigDeps


class LightwellConan(ConanFile):
    name = "lightwell"
    license = "Apache-2.0"
    description = "Host SDK of Lightwell light probes for augmented reality"
    topics = ("augmented-reality", "light-estimation", "spherical-harmonics")
    settings = "os", "compiler", "build_type", "arch"
    options = {
        # conan: libraries of Conan's remotes. system: those that cmake/packages.txt lists, installed on this machine.
        "dependencies": ["conan", "system"],
        "grpc": [True, False],
        "web": [True, False],
        "mqtt": [True, False],
        "usb": [True, False],
        "mdns": [True, False],
    }
    default_options = {"dependencies": "conan", "grpc": True, "web": True, "mqtt": True, "usb": True, "mdns": True}
    # What the build of the SDK reads.
    SOURCES = ("CMakeLists.txt", "LICENSE", "cmake/*", "proto/*", "host_sdk/*")

    def _root(self):
        return Path(self.recipe_folder).resolve().parents[2]

    def set_version(self):
        text = (self._root() / "CMakeLists.txt").read_text(encoding="utf-8")
        self.version = re.search(r"project\(lightwell VERSION ([0-9.]+)", text)[1]

    def export_sources(self):
        for pattern in self.SOURCES:
            copy(self, pattern, self._root(), self.export_sources_folder, excludes=("*/node_modules/*", "*/recipes/*"))

    def validate(self):
        check_min_cppstd(self, 20)
        if self.settings.os != "Linux":
            raise ConanInvalidConfiguration("this recipe builds for Linux; for Windows see host_sdk/README.md")

    def requirements(self):
        if self.options.dependencies == "system":
            return
        self.requires("protobuf/[>=3.21 <3.22]")
        self.requires("highway/[>=1.0.3 <2]")
        if self.options.grpc or self.options.web:
            self.requires("openssl/[>=3 <4]")
        if self.options.grpc:
            self.requires("grpc/[>=1.50 <2]")
        if self.options.web:
            self.requires("libwebsockets/[>=4.3 <5]")
        if self.options.mqtt:
            self.requires("mosquitto/[>=2 <3]")
        if self.options.usb:
            self.requires("libusb/[>=1.0.26 <2]")
        if self.options.mdns:
            self.requires("avahi/[>=0.8 <1]")

    def build_requirements(self):
        if self.options.dependencies == "conan":
            self.tool_requires("protobuf/<host_version>")
            if self.options.grpc:
                self.tool_requires("grpc/<host_version>")

    def generate(self):
        toolchain = CMakeToolchain(self)
        toolchain.cache_variables.update({
            "LIGHTWELL_BUILD_FIRMWARE": False, "LIGHTWELL_BUILD_TESTS": False, "LIGHTWELL_BUILD_HIL": False,
            "LIGHTWELL_WITH_GRPC": bool(self.options.grpc),
            "LIGHTWELL_WITHOUT": ";".join(["ar_viewer", "openxr_layer"] + [
                part for part in ("web", "mqtt", "usb", "mdns") if not self.options.get_safe(part)]),
        })
        toolchain.generate()
        if self.options.dependencies == "conan":
            CMakeDeps(self).generate()
            # CMake finds all but protobuf, gRPC and OpenSSL by pkg-config.
            PkgConfigDeps(self).generate()

    def build(self):
        cmake = CMake(self)
        cmake.configure()
        cmake.build()

    def package(self):
        CMake(self).install()
        copy(self, "LICENSE", self.source_folder, str(Path(self.package_folder) / "licenses"))
        rmdir(self, str(Path(self.package_folder) / "lib" / "python3"))

    def package_info(self):
        # The SDK's own package file, with the targets lightwell::lightwell and lightwell::lightwell_c.
        self.cpp_info.set_property("cmake_find_mode", "none")
        self.cpp_info.builddirs = ["lib/cmake/lightwell"]
        self.cpp_info.libs = ["lightwell"]
