// lightwell-calibrate: calibrates a camera; the main program of the subcommands.
#include <string>
#include <vector>

#include "tools/command_line.hpp"
#include "tools/lightwell_calibrate/commands.hpp"

int main(int argc, char** argv) {
  CLI::App app{"Calibrates the direction and the radiance of each pixel of a camera.", "lightwell-calibrate"};
  app.footer(
      "Each has a --help with examples. For a new camera: board (print it); coverage, while taking pictures; "
      "geometry;\n"
      "photometry; mounting, when the camera is installed.\n"
      "Exit status: 0 done, 1 an input is wrong (standard error has the reason and the remedy), 2 wrong usage.");
  app.require_subcommand(1);
  int status = lightwell::kDone;
  const auto add = [&](const char* name, const char* what, int (*run)(const std::vector<std::string>&)) {
    // The subcommand parses its arguments, --help too.
    CLI::App* command = app.add_subcommand(name, what);
    command->set_help_flag();
    command->prefix_command();
    command->callback([&status, run, command] { status = run(command->remaining()); });
  };
  namespace calibrate = lightwell::calibrate;
  add("board", "A board of tags to print, true to scale", calibrate::board_command);
  add("marker-sheet", "A paper body with tags for light estimation, to print and fold",
      calibrate::marker_sheet_command);
  add("coverage", "Which part of the picture still lacks views of the board", calibrate::coverage_command);
  add("geometry", "Lens models, and the relative pose of two lenses, from pictures of boards",
      calibrate::geometry_command);
  add("photometry", "Response, black level, noise, vignetting, white balance, scale", calibrate::photometry_command);
  add("mounting", "The pose of the probe in the room, from tags in view", calibrate::mounting_command);
  add("import", "A calibration of OpenCV's, Kalibr's or ROS's", calibrate::import_command);
  if (const auto exit = lightwell::parse_command_line(app, {argv + 1, argv + argc})) return *exit;
  return status;
}
