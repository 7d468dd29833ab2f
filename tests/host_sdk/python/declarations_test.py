#!/usr/bin/env python3
"""How the Python package reads C headers. usage: declarations_test.py"""
import sys
import unittest

from lightwell._declarations import Declarations


class Headers(unittest.TestCase):
    """What _declarations.py reads, and what it refuses to guess."""

    def read(self, text):
        read = Declarations()
        read.add(text)
        return read

    def test_structs_have_the_layout_of_c(self):
        read = self.read("""#define LW_MANY 3 /* of; them { */
            typedef struct lw_thing lw_thing;
            enum { LW_A = 1, LW_B = 1 << 4 };
            typedef int32_t lw_kind;
            typedef struct lw_all { uint32_t size; lw_kind kind; float rgb[LW_MANY]; int64_t ns; const char* text; }
            lw_all;
            LW_API lw_kind lw_take(const lw_thing* thing, const lw_all* all, size_t count);""")
        struct = read.structs["lw_all"]
        offsets = [getattr(struct, name).offset for name in ("size", "kind", "rgb", "ns", "text")]
        self.assertEqual((offsets, struct().size), ([0, 4, 8, 24, 32], 40))
        self.assertEqual(read.constants, {"LW_MANY": 3, "LW_A": 1, "LW_B": 16})
        self.assertEqual(len(read.functions["lw_take"][1]), 3)

    def test_what_is_not_known_is_an_error(self):
        for text in ("typedef union lw_u { int32_t a; } lw_u;", "LW_API int lw_f(void);",
                     "LW_API int32_t lw_f(lw_x* x);", "enum { LW_A = OTHER };",
                     "typedef struct lw_s { uint32_t size; int32_t (*call)(void); } lw_s;",
                     "typedef struct lw_s { int32_t grid[2][3]; } lw_s;", "typedef struct lw_s { uint32_t size;"):
            with self.assertRaises(ImportError, msg=text):
                self.read(text)


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1])
