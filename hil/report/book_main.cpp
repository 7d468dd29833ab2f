// book_report: receives the light and the captured plane of a book_frames sequence through the SDK, compares them with
// the truth, and draws a picture.
#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <iostream>
#include <thread>

#include <CLI/CLI.hpp>
#include <nlohmann/json.hpp>

#include <lightwell/probe.hpp>

#include "measure/glossy_book.hpp"
#include "report/book_evaluation.hpp"
#include "report/book_picture.hpp"

namespace {

using namespace lightwell;

enum Exit : int { kOk = 0, kPoor = 1, kUsage = 2, kBadInput = 3 };

/// Between the 0.045 of a short sequence of 320x240, whose pixels are larger than texels, and the 0.11 of poses from
/// tags alone. The paper's figures for real books are 0.029, 0.049 and 0.116 (Jachnik et al. 2012, table 1).
constexpr double kMaxRmse = 0.08;
/// From one descriptor to the next.
constexpr Duration kFrameTimeout{60'000'000'000};

int fail(const Status& s) {
  std::cerr << "book_report: " << s.message() << "\n";
  return kBadInput;
}

/// What was received up to the last frame of the sequence.
struct Received {
  Lighting light;
  PlaneAppearance plane;
  std::uint64_t descriptors = 0;
};

Result<Received> receive(const std::string& uri, int frames) {
  ProbeOptions options;
  options.max_age = kFrameTimeout;
  options.plane = PlaneReception::receive;
  const Result<Probe> probe = Probe::connect(uri, options);
  if (!probe) return probe.status();
  Received out;
  std::optional<std::uint64_t> newest;
  for (int tenths = 0; !newest || *newest + 1 < static_cast<std::uint64_t>(frames);) {
    Result<Lighting> next = probe->wait_for_next(newest, kFrameTimeout);
    if (!next) return next.status();
    out.light = std::move(*next);
    newest = out.light.descriptor().sequence;
    if (const int done = static_cast<int>(10 * (*newest + 1) / static_cast<std::uint64_t>(frames)); done > tenths) {
      tenths = done;
      std::fprintf(stderr, "received: light of frame %d of %d; %.0f %% of the directions seen\n",
                   static_cast<int>(*newest + 1), frames, 100 * probe->plane().guidance().seen);
    }
  }
  out.descriptors = probe->stats().received;
  // The plane is sent once a second: wait until it has the last frame.
  const ProbeTime last = out.light.descriptor().time.mid_exposure;
  const auto complete = [&] {
    out.plane = probe->plane();
    return out.plane.missing_tiles() == 0 && out.plane.info().mid_exposure >= last;
  };
  for (int k = 0; k < 3000 && !complete(); ++k) std::this_thread::sleep_for(std::chrono::milliseconds(10));
  if (out.plane.validity() == Validity::none || out.plane.texture_edge() == 0)
    return Status(StatusCode::failed_precondition,
                  uri +
                      " sent no plane with its texture; lightwelld needs --estimator specular and, in its "
                      "configuration, images: IMAGE_RECIPIENTS_ALL_CLIENTS");
  return out;
}

void print_json(const hil::BookNumbers& n, const Received& received, const measure::SpecularSequenceOptions& options) {
  const nlohmann::ordered_json out = {{"frames", options.frames},
                                      {"descriptors", received.descriptors},
                                      {"seen", n.seen},
                                      {"alpha", n.alpha},
                                      {"true_alpha", options.alpha},
                                      {"rmse", n.rmse},
                                      {"rmse_shown", n.rmse_shown},
                                      {"unseen", n.unseen},
                                      {"irradiance_error", n.irradiance_error},
                                      {"irradiance_bound", n.irradiance_bound},
                                      {"strongest_light_deg", n.strongest_light_deg},
                                      {"shadow_rms", n.shadow_rms}};
  std::cout << out << std::endl;
}

void print_text(const hil::BookNumbers& n, const Received& received, const measure::SpecularSequenceOptions& options) {
  std::printf(
      "%llu descriptors of %d frames; %.0f %% of the directions seen; alpha %.3f (true %.3f)\n"
      "views that are not among the frames: RMSE %.3f of full scale; %.0f %% of their pixels in unseen directions\n"
      "irradiance: error %.1f %%, bound %.1f %%; strongest light %.1f deg off; shadows: RMS %.3f\n",
      static_cast<unsigned long long>(received.descriptors), options.frames, 100 * n.seen, n.alpha, options.alpha,
      n.rmse, 100 * n.unseen, 100 * n.irradiance_error, 100 * n.irradiance_bound, n.strongest_light_deg, n.shadow_rms);
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app{
      "Receives light and captured plane from a lightwelld that plays a folder of book_frames in a loop, compares them "
      "with the "
      "truth of the rendering, and draws a picture. --frames, --width and --height as given to book_frames."};
  app.footer(
      "Exit status: 0 the error of the irradiance is within the bound, if there is one, and the RMSE of the held-out "
      "views is at most 0.08; 1 one of them is not; 2 wrong usage; 3 invalid input or no connection.");
  std::string uri, picture;
  int frames = 300, width = 640, height = 480;
  bool json = false;
  app.add_option("uri", uri, "Address of lightwelld, grpc://...")->required();
  app.add_option("--frames", frames, "Number of frames [300]")->check(CLI::Range(1, 100'000));
  app.add_option("--width", width, "Width of a frame [640]")->check(CLI::Range(160, 4096));
  app.add_option("--height", height, "Height of a frame [480]")->check(CLI::Range(120, 4096));
  app.add_option("--picture", picture, "PNG file to draw");
  app.add_flag("--json", json, "Print one JSON object instead of text");
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& e) {
    return app.exit(e) == 0 ? kOk : kUsage;
  }

  // Connected first: the frames are played meanwhile.
  const Result<Received> received = receive(uri, frames);
  if (!received) return fail(received.status());
  const auto options = measure::book_sequence(frames, width, height);
  if (!options) return fail(options.status());
  const auto sequence = measure::SpecularSequence::make(*options);
  if (!sequence) return fail(sequence.status());
  const Lighting light = received->light.in_world(inverse(received->light.origin()));
  std::fprintf(stderr, "comparing with the truth\n");
  const auto evaluation = hil::evaluate_book(**sequence, received->plane, light);
  if (!evaluation) return fail(evaluation.status());
  const hil::BookNumbers& numbers = evaluation->numbers;
  (json ? print_json : print_text)(numbers, *received, *options);
  if (!picture.empty())
    if (const Status s = hil::draw_book_report(picture, **sequence, received->plane, light, *evaluation); !s.ok())
      return fail(s);
  return numbers.irradiance_error <= numbers.irradiance_bound && numbers.rmse <= kMaxRmse ? kOk : kPoor;
}
