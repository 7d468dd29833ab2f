// book_frames: renders a hand-held sequence of a glossy book with tags, in a folder for the replay camera.
#include <cstdio>
#include <filesystem>
#include <iostream>

#include <CLI/CLI.hpp>

#include "measure/glossy_book.hpp"

namespace {

using namespace lightwell;

enum Exit : int { kOk = 0, kUsage = 2, kBadInput = 3, kNotWritten = 4 };

int fail(int code, const std::string& why) {
  std::cerr << "book_frames: " << why << "\n";
  return code;
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app{
      "Renders a glossy book with an AprilTag in each corner, in a room with a window and lamps, as a hand-held camera "
      "sees it: noisy 8-bit sRGB frames, played forth and back, with frames.csv, calibration.textproto and "
      "book.textproto, for replay:FOLDER."};
  app.footer(
      "Example:\n"
      "  book_frames /tmp/book --frames 300\n"
      "  lightwelld --camera 'replay:/tmp/book?pace=fast' --estimator specular --plane /tmp/book/book.textproto\n"
      "Exit status: 0 done, 2 wrong usage, 3 the room cannot be read, 4 the folder cannot be written.");
  std::string out;
  int frames = 300, length = 0, width = 640, height = 480;
  double period_s = 1 / 30.0;
  app.add_option("folder", out, "Output folder; created if missing")->required();
  app.add_option("--frames", frames, "Number of frames [300]")->check(CLI::Range(1, 100'000));
  app.add_option("--sequence", length, "Frames of the whole sequence, if only its first ones are wanted [--frames]");
  app.add_option("--period-s", period_s, "Time between frames in seconds [1/30]")->check(CLI::PositiveNumber);
  app.add_option("--width", width, "Width of a frame [640]")->check(CLI::Range(160, 4096));
  app.add_option("--height", height, "Height of a frame [480]")->check(CLI::Range(120, 4096));
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& e) {
    return app.exit(e) == 0 ? kOk : kUsage;
  }

  const auto options = measure::book_sequence(std::max(frames, length), width, height);
  if (!options) return fail(kBadInput, options.status().message());
  const auto book = measure::tagged_book(options->seed);
  if (!book) return fail(kBadInput, book.status().message());
  const auto sequence = measure::SpecularSequence::make(*options);
  if (!sequence) return fail(kBadInput, sequence.status().message());
  std::error_code error;
  std::filesystem::create_directories(out, error);
  const auto progress = [&](int written) {
    if (written == frames || written % std::max(1, frames / 10) == 0)
      std::fprintf(stderr, "rendered: %d of %d frames\n", written, frames);
  };
  const Status s = measure::write_replay(**sequence, frames, book->plane, out, period_s, progress);
  return s.ok() ? kOk : fail(kNotWritten, s.message());
}
