// Draws the JSON of a tool with firmware/tools/lightwell_plot.py.
#pragma once

#include <chrono>
#include <string>

#include <gtest/gtest.h>

#include "support/child.hpp"
#include "support/temp_dir.hpp"

namespace lightwell::test {

/// The path of the picture `name`, by its ending .png or .svg, in the folder. A failure of the script fails the test.
inline std::string plotted(const TempDir& folder, const std::string& json, const std::string& name) {
  Child child(
      {LIGHTWELL_PYTHON_MATPLOTLIB, LIGHTWELL_PLOT, folder.write(name + ".json", json), "--output", folder.path(name)});
  // Its first run on a machine makes a list of all fonts.
  EXPECT_EQ(child.wait(std::chrono::minutes(2)), ExitStatus{0}) << child.err();
  return folder.path(name);
}

}  // namespace lightwell::test
