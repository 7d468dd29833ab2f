"""Mitsuba's `llvm` variants need an LLVM library that is newer than Debian 12's. Import this before drjit and mitsuba:
DRJIT_LIBLLVM_PATH names the library, else that of a Rust toolchain is taken. Without one, Mitsuba reports that it
cannot initialize.
"""

import glob
import os
from pathlib import Path

if "DRJIT_LIBLLVM_PATH" not in os.environ:
    # The small ones are linker scripts.
    found = glob.glob(str(Path.home() / ".rustup/toolchains/*/lib/libLLVM*.so*"))
    if found:
        os.environ["DRJIT_LIBLLVM_PATH"] = max(sorted(found), key=os.path.getsize)
