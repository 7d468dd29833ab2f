// marker_frames: converts path-traced images of a marker to frames of a webcam, in a folder for the replay camera.
#include <algorithm>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <iostream>
#include <sstream>

#include <CLI/CLI.hpp>

#include <lightwell/calibration.hpp>
#include <lightwell/marker_body.hpp>

#include "imaging/image_file.hpp"
#include "measure/traced_frames.hpp"

namespace {

using namespace lightwell;

enum Exit : int { kOk = 0, kUsage = 2, kBadInput = 3, kNotWritten = 4 };

int fail(int code, const std::string& why) {
  std::cerr << "marker_frames: " << why << "\n";
  return code;
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app{
      "Converts path-traced images of tests/reference/mitsuba/marker to noisy 8-bit sRGB frames, as of a webcam, and "
      "writes them with frames.csv and calibration.textproto to a folder for replay:FOLDER."};
  app.footer(
      "Example:\n"
      "  marker_frames /tmp/frames --picture grid_straight_white_front_right,grid_straight_white_back_right --noisy 3\n"
      "  lightwelld --camera 'replay:/tmp/frames?loop=0' --estimator marker --body dodecahedron_100mm_white.textproto\n"
      "All images must be of the same camera and the same body.\n"
      "Exit status: 0 done, 2 wrong usage, 3 invalid input, 4 the folder cannot be written.");
  std::string out, names = "grid_straight_white_front_right", frames_folder = LIGHTWELL_MARKER_FRAMES,
                   bodies = LIGHTWELL_MARKER_BODIES;
  int noisy = 3;
  double period_s = 1;
  app.add_option("folder", out, "Output folder; created if missing")->required();
  app.add_option("--picture", names, "Names of images, separated by commas, in their order [" + names + "]");
  app.add_option("--noisy", noisy, "Number of frames of each image, each with its own noise [3]")
      ->check(CLI::Range(1, 1000));
  app.add_option("--period-s", period_s, "Time between frames in seconds [1]")->check(CLI::PositiveNumber);
  app.add_option("--frames", frames_folder, "Folder with scenes.json and the images");
  app.add_option("--bodies", bodies, "Folder with the marker bodies");
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& e) {
    return app.exit(e) == 0 ? kOk : kUsage;
  }

  const auto frames = measure::load_traced_frames(frames_folder);
  if (!frames) return fail(kBadInput, frames.status().message());
  std::error_code error;
  std::filesystem::create_directories(out, error);
  std::ofstream list(out + "/frames.csv");
  list << "file,exposure_s,time_s\n";
  measure::TracedSensor webcam;
  webcam.srgb = true;
  std::string body_name, calibration, name;
  int number = 0;
  for (std::istringstream each(names); std::getline(each, name, ',');) {
    const auto frame = std::ranges::find(*frames, name, &measure::TracedFrame::name);
    if (frame == frames->end())
      return fail(kBadInput, "there is no image '" + name + "' in " + frames_folder + "/scenes.json");
    const auto body = load_marker_body(bodies + "/dodecahedron_100mm_" + frame->body + ".textproto");
    if (!body) return fail(kBadInput, body.status().message());
    const auto picture = measure::TracedPicture::load(frames_folder, *frame, *body);
    if (!picture) return fail(kBadInput, picture.status().message());
    const std::string lens = calibration_to_text(picture->rig_for(webcam));
    if (!calibration.empty() && (lens != calibration || body->name != body_name))
      return fail(kBadInput, "the image '" + name + "' is of another camera or body than the previous ones");
    calibration = lens;
    body_name = body->name;
    for (int k = 0; k < noisy; ++k, ++number) {
      const measure::Shot shot = picture->expose(webcam, static_cast<std::uint64_t>(k));
      const LensParameters& size = frame->rig.lenses.front();
      const std::string file = std::to_string(number) + ".png";
      if (Status s = write_png(out + "/" + file, {size.width, size.height, PixelFormat::rgb8, shot.pixels.front()});
          !s.ok())
        return fail(kNotWritten, s.message());
      list << file << "," << shot.frames.front().info.exposure_s << "," << period_s * number << "\n";
    }
  }
  std::ofstream lens(out + "/calibration.textproto");
  lens << calibration;
  if (!list.flush() || !lens.flush()) return fail(kNotWritten, "cannot write to " + out);
  std::printf("%d frames of the body %s in %s\n", number, body_name.c_str(), out.c_str());
  return kOk;
}
