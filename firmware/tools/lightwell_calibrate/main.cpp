// lightwell-calibrate: calibrates a camera; the main program of the subcommands.
#include <cstdio>
#include <cstring>
#include <span>

#include "tools/lightwell_calibrate/board_command.hpp"
#include "tools/lightwell_calibrate/geometry_command.hpp"
#include "tools/lightwell_calibrate/import_command.hpp"
#include "tools/lightwell_calibrate/marker_sheet_command.hpp"
#include "tools/lightwell_calibrate/mounting_command.hpp"
#include "tools/lightwell_calibrate/photometry_command.hpp"

namespace {

struct Command {
  const char* name;
  const char* what;
  int (*run)(std::span<char* const> arguments);
};

constexpr Command kCommands[] = {
    {"board", "a board of tags to print, true to scale", lightwell::calibrate::board_command},
    {"marker-sheet", "a paper body with tags for light estimation, to print and fold",
     lightwell::calibrate::marker_sheet_command},
    {"coverage", "which part of the picture still lacks views of the board", lightwell::calibrate::coverage_command},
    {"geometry", "lens models, and the relative pose of two lenses, from pictures of boards",
     lightwell::calibrate::geometry_command},
    {"photometry", "response, black level, noise, vignetting, white balance, scale",
     lightwell::calibrate::photometry_command},
    {"mounting", "the pose of the probe in the room, from tags in view", lightwell::calibrate::mounting_command},
    {"import", "a calibration of OpenCV's, Kalibr's or ROS's", lightwell::calibrate::import_command},
};

void print_help(std::FILE* to) {
  std::fprintf(to, "lightwell-calibrate: calibrates the direction and the radiance of each pixel of a camera.\n\n");
  for (const Command& c : kCommands) std::fprintf(to, "  lightwell-calibrate %-12s %s\n", c.name, c.what);
  std::fprintf(
      to,
      "\nEach has a --help with examples. For a new camera: board (print it); coverage, while taking pictures; "
      "geometry;\n"
      "photometry; mounting, when the camera is installed.\n"
      "Exit status: 0 done, 1 an input is wrong (standard error has the reason and the remedy), 2 wrong usage.\n");
}

}  // namespace

int main(int argc, char** argv) {
  const char* wanted = argc > 1 ? argv[1] : "";
  if (std::strcmp(wanted, "--help") == 0 || std::strcmp(wanted, "-h") == 0) return print_help(stdout), 0;
  for (const Command& c : kCommands)
    if (std::strcmp(wanted, c.name) == 0)
      return c.run(std::span<char* const>(argv + 2, static_cast<std::size_t>(argc - 2)));
  if (argc > 1) std::fprintf(stderr, "lightwell-calibrate: unknown subcommand '%s'\n\n", wanted);
  print_help(stderr);
  return 2;
}
