// lightwell-estimate: one descriptor from still images.
#include <algorithm>
#include <charconv>
#include <cmath>
#include <iostream>
#include <numbers>
#include <optional>
#include <string>
#include <vector>

#include <lightwell/codec.hpp>
#include <lightwell/config.hpp>
#include <lightwell/files.hpp>

#include "app/tag_body_finder.hpp"
#include "estimate/marker/marker_estimator.hpp"
#include "estimate/panorama/panorama_estimator.hpp"
#include "tools/image_bracket.hpp"

namespace {

using namespace lightwell;

constexpr const char* kHelp = R"(lightwell-estimate: estimates the lighting of a place from still images.

  lightwell-estimate --equirect PANORAMA.exr --json -
  lightwell-estimate --calibration RIG.textproto fisheye.png --json -
  lightwell-estimate --calibration RIG.textproto --lens 0 front.exr --lens 1 back.exr --json out.json
  lightwell-estimate --calibration RIG.textproto --exposure-s 0.001 a.png --exposure-s 0.03 b.png --json -
  lightwell-estimate --calibration WEBCAM.textproto --body DODECAHEDRON.textproto photo.png --json -

Images are read in order; --lens and --exposure-s apply to the images after them.
  --calibration FILE   the camera's calibration (proto/lightwell/v1/calibration.proto, text format)
  --equirect IMAGE     a whole panorama; needs no calibration (PNG and JPEG: sRGB response)
  --lens N             lens of the rig that the images after it belong to [0]
  --exposure-s E       exposure of the next image in seconds; a bracket gives one before each image
  --body FILE          estimate light from this marker in the picture (the file of lightwell-calibrate marker-sheet)
  --json FILE          write the descriptor as protobuf JSON; - is standard output
  --binary FILE        write the encoded descriptor (wire format)
  --band N             highest band of the harmonics, 0 to 6 [4]
  --max-lights N       maximum number of lights, 0 to 64 [8]
  --help               this text

PNG and JPEG: 8 bits, decoded with the response curve of the calibration. EXR and HDR: linear radiance in relative units
(divided by the exposure if one is given). Directions in the result are in the probe's frame: +X right, +Y up, -Z
forward. Meaning of the fields: proto/README.md.
Exit status: 0 done, 1 an input is wrong (standard error has the reason and the remedy), 2 wrong usage.
)";

enum Exit : int { kOk = 0, kBadInput = 1, kUsage = 2 };

struct Arguments {
  std::string calibration, equirect, body, json, binary;
  std::vector<ImageArgument> images;
  EstimatorConfig config;
  bool help = false;
};

template <class T>
std::optional<T> number(const std::string& text) {
  T value{};
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc() || end != text.data() + text.size()) return std::nullopt;
  return value;
}

/// Parsed without CLI11, because --lens and --exposure-s apply to the images that follow them.
Result<Arguments> parse(const std::vector<std::string>& words) {
  Arguments out;
  int lens = 0;
  double exposure = 0;
  const auto usage = [](const std::string& what) {
    return Status(StatusCode::invalid_argument, what + "; see --help");
  };
  for (std::size_t i = 0; i < words.size(); ++i) {
    std::string word = words[i];
    if (word == "--help" || word == "-h") {
      out.help = true;
      return out;
    }
    if (word.size() < 2 || word[0] != '-' || word[1] != '-') {
      out.images.push_back({word, lens, exposure});
      exposure = 0;
      continue;
    }
    static constexpr std::string_view kOptions[] = {"--calibration", "--equirect", "--body",
                                                    "--json",        "--binary",   "--lens",
                                                    "--exposure-s",  "--band",     "--max-lights"};
    if (std::find(std::begin(kOptions), std::end(kOptions), std::string_view(word).substr(0, word.find('='))) ==
        std::end(kOptions))
      return usage("unknown option " + word);
    std::optional<std::string> value;
    if (const auto equals = word.find('='); equals != std::string::npos) {
      value = word.substr(equals + 1);
      word.resize(equals);
    } else if (i + 1 < words.size()) {
      value = words[++i];
    }
    if (!value) return usage(word + " needs a value");
    const auto bad = [&] { return usage(word + ": '" + *value + "' is not a valid value"); };
    if ((word == "--calibration" && !out.calibration.empty()) || (word == "--equirect" && !out.equirect.empty()))
      return usage(word + " is given twice");
    if (word == "--calibration") {
      out.calibration = *value;
    } else if (word == "--equirect") {
      out.equirect = *value;
    } else if (word == "--body") {
      out.body = *value;
    } else if (word == "--json") {
      out.json = *value;
    } else if (word == "--binary") {
      out.binary = *value;
    } else if (word == "--lens") {
      const auto n = number<int>(*value);
      if (!n || *n < 0) return bad();
      lens = *n;
    } else if (word == "--exposure-s") {
      const auto e = number<double>(*value);
      if (!e || !(*e > 0) || !std::isfinite(*e)) return bad();
      exposure = *e;
    } else if (word == "--band") {
      const auto n = number<int>(*value);
      if (!n) return bad();
      out.config.band = *n;
    } else if (word == "--max-lights") {
      const auto n = number<int>(*value);
      if (!n) return bad();
      out.config.max_lights = *n;
    }
  }
  if (!out.equirect.empty() && exposure > 0)
    return usage(
        "--equirect takes one image without exposure; a bracket of panoramas needs --calibration with equirectangular "
        "{}");
  if (exposure > 0) return usage("--exposure-s has no image after it; it applies to the next one");
  if (out.equirect.empty() == out.calibration.empty())
    return usage("give either --calibration with images or --equirect with one");
  if (!out.equirect.empty() && !out.body.empty()) return usage("--body needs --calibration, that of the camera");
  if (!out.equirect.empty() && !out.images.empty())
    return usage("--equirect takes one image; more images need --calibration");
  if (const Status s = out.config.validate(); !s.ok()) return usage(s.message());
  return out;
}

Result<std::unique_ptr<Estimator>> make_estimator(const Arguments& arguments, const RigParameters& rig) {
  if (arguments.body.empty()) {
    PanoramaOptions options;
    options.config = arguments.config;
    options.probe_id = fnv1a_32("lightwell-estimate");
    return make_panorama_estimator(rig, options);
  }
  const Result<MarkerBody> body = load_marker_body(arguments.body);
  if (!body) return body.status();
  Result<std::unique_ptr<BodyFinder>> finder = make_tag_body_finder(rig, *body);
  if (!finder) return finder.status();
  MarkerOptions options;
  options.config = arguments.config;
  options.probe_id = fnv1a_32("lightwell-estimate");
  Result<std::unique_ptr<MarkerEstimator>> marker = make_marker_estimator(rig, *body, std::move(*finder), options);
  if (!marker) return marker.status();
  return std::unique_ptr<Estimator>(std::move(*marker));
}

Result<Descriptor> descriptor_of(const Arguments& arguments) {
  std::vector<ImageArgument> images = arguments.images;
  RigParameters rig;
  if (!arguments.equirect.empty()) {
    const Result<Image> image = read_image(arguments.equirect);
    if (!image) return image.status();
    if (image->width != 2 * image->height)
      return Status(StatusCode::invalid_argument,
                    arguments.equirect + ": an equirectangular panorama is twice as wide as high, this one has " +
                        std::to_string(image->width) + "x" + std::to_string(image->height) + " pixels");
    rig = equirectangular_rig(image->width, image->height);
    images = {{arguments.equirect, 0, 0}};
  } else {
    Result<RigParameters> loaded = load_calibration(arguments.calibration);
    if (!loaded) return loaded.status();
    rig = std::move(*loaded);
  }
  const Result<ImageBracket> bracket = read_bracket(rig, images);
  if (!bracket) return bracket.status();
  if (bracket->invalid_values > 0)
    std::cerr << "lightwell-estimate: " << bracket->invalid_values
              << " values are negative, NaN or infinite and were replaced (flag CLEANED)\n";
  Result<std::unique_ptr<Estimator>> estimator = make_estimator(arguments, bracket->rig);
  if (!estimator) return estimator.status();
  Descriptor descriptor;
  if (const Status s = (*estimator)->estimate(bracket->frames, descriptor); !s.ok()) return s;
  return descriptor;
}

Status write_file(const std::string& path, std::string_view bytes) {
  if (path == "-") {
    std::cout << bytes << std::flush;
    return std::cout ? Status() : Status(StatusCode::data_loss, "standard output cannot be written");
  }
  return write_atomically(path, bytes, FileMode::umask);
}

void print_summary(const Descriptor& d, std::size_t bytes) {
  const double degree = 180 / std::numbers::pi;
  std::cout << "harmonics to band " << d.radiance.band << ", " << d.lights.size() << " lights, " << bytes
            << " bytes; sees " << 100 * d.coverage << " % of the sphere; bound " << 100 * d.bound.total << " %";
  for (const Flag f : kFlags)
    if (d.flags.has(f)) std::cout << "; " << to_string(f);
  std::cout << "\n";
  for (const Light& l : d.lights)
    std::cout << "light towards (" << l.direction.x << ", " << l.direction.y << ", " << l.direction.z
              << "), irradiance (" << l.irradiance.r << ", " << l.irradiance.g << ", " << l.irradiance.b << "), radius "
              << l.angular_radius_rad * degree << " deg\n";
}

}  // namespace

int main(int argc, char** argv) {
  const auto fail = [](const Status& s, int exit) {
    std::cerr << "lightwell-estimate: " << s.message() << "\n";
    return exit;
  };
  const Result<Arguments> arguments = parse({argv + 1, argv + argc});
  if (!arguments) return fail(arguments.status(), kUsage);
  if (arguments->help) {
    std::cout << kHelp;
    return kOk;
  }
  const Result<Descriptor> descriptor = descriptor_of(*arguments);
  if (!descriptor) return fail(descriptor.status(), kBadInput);
  Encoder encoder;
  const Result<std::span<const std::byte>> bytes = encoder.encode(*descriptor);
  if (!bytes) return fail(bytes.status(), kBadInput);
  if (!arguments->binary.empty())
    if (const Status s = write_file(arguments->binary, {reinterpret_cast<const char*>(bytes->data()), bytes->size()});
        !s.ok())
      return fail(s, kBadInput);
  if (!arguments->json.empty()) {
    const Result<std::string> json = descriptor_to_json(*bytes);
    if (!json) return fail(json.status(), kBadInput);
    if (const Status s = write_file(arguments->json, *json + "\n"); !s.ok()) return fail(s, kBadInput);
  } else if (arguments->binary.empty()) {
    print_summary(*descriptor, bytes->size());
  }
  return kOk;
}
