// lightwell-estimate: one descriptor from still images.
#include <algorithm>
#include <cmath>
#include <cstring>
#include <iostream>
#include <map>
#include <numbers>
#include <optional>
#include <string>
#include <vector>

#include <lightwell/codec.hpp>
#include <lightwell/estimator_config.hpp>
#include <lightwell/query.hpp>
#include <lightwell/text.hpp>

#include "app/tag_body_finder.hpp"
#include "estimate/marker/marker_estimator.hpp"
#include "estimate/panorama/panorama_estimator.hpp"
#include "estimate/specular/specular_estimator.hpp"
#include "tools/command_line.hpp"
#include "tools/lens_image.hpp"

namespace {

using namespace lightwell;

constexpr const char* kFooter = R"(Examples:
  lightwell-estimate --equirect PANORAMA.exr --json -
  lightwell-estimate --calibration RIG.textproto fisheye.png --json -
  lightwell-estimate --calibration RIG.textproto --lens 0 front.exr --lens 1 back.exr --json out.json
  lightwell-estimate --calibration RIG.textproto --exposure-s 0.001 a.png --exposure-s 0.03 b.png --json -
  lightwell-estimate --calibration WEBCAM.textproto --body DODECAHEDRON.textproto photo.png --json -
  lightwell-estimate --calibration WEBCAM.textproto --plane BOOK.textproto frames/*.png --json -

--plane takes the pictures of a camera that moves around a glossy plane, some hundred of them, in their order; the
result is that of the last one. A picture in which the plane's tags are not found is left out.
PNG and JPEG: 8 bits, decoded with the response curve of the calibration. EXR and HDR: linear radiance in relative units
(divided by the exposure if one is given). Directions in the result are in the probe's frame: +X right, +Y up, -Z
forward. Meaning of the fields: proto/README.md.
Exit status: 0 done, 1 an input is wrong (standard error has the reason and the remedy), 2 wrong usage.)";

struct ImageArgument {
  std::string path;
  int lens = 0;
  double exposure_s = 0;  ///< 0: not given.
};

struct Arguments {
  std::string calibration, equirect, body, plane, json, binary;
  std::vector<ImageArgument> images;
  EstimatorConfig config;
};

/// Throws UsageError if something is missing or contradictory.
void check(const Arguments& in) {
  if (in.equirect.empty() == in.calibration.empty())
    throw UsageError("give either --calibration with images or --equirect with one");
  if (!in.equirect.empty() && !in.body.empty()) throw UsageError("--body needs --calibration, that of the camera");
  if (!in.equirect.empty() && !in.plane.empty()) throw UsageError("--plane needs --calibration, that of the camera");
  if (!in.body.empty() && !in.plane.empty()) throw UsageError("give either --body or --plane");
  if (!in.equirect.empty() && !in.images.empty())
    throw UsageError("--equirect takes one image; more images need --calibration");
  if (const Status s = in.config.validate(); !s.ok()) throw UsageError(s.message());
}

/// A bracket whose frames refer to the images that it owns.
struct ImageBracket {
  std::map<int, std::map<double, Image>> images;  ///< By lens and exposure, s.
  std::vector<Frame> frames;
  /// Number of values of float images that are negative, NaN or infinite, which the estimator replaces.
  std::size_t invalid_values = 0;
  RigParameters rig;  ///< The lenses that have images, renumbered from 0 in their order.
};

std::size_t count_invalid(const Image& image) {
  if (image.format != PixelFormat::rgb_f32) return 0;
  std::vector<float> values(image.data.size() / sizeof(float));
  std::memcpy(values.data(), image.data.data(), values.size() * sizeof(float));
  return static_cast<std::size_t>(std::ranges::count_if(values, [](float v) { return !(v >= 0 && std::isfinite(v)); }));
}

/// Reads the images and combines the exposures of all lenses to frames, shortest first. Default exposure: 1 s.
ImageBracket read_bracket(const RigParameters& rig, const std::vector<ImageArgument>& arguments) {
  if (arguments.empty()) refuse("no image is given");
  ImageBracket out;
  for (const ImageArgument& a : arguments) {
    Image image = require(read_lens_image(a.path, rig, a.lens));
    out.invalid_values += count_invalid(image);
    const double exposure_s = a.exposure_s > 0 ? a.exposure_s : 1;
    if (!out.images[a.lens].emplace(exposure_s, std::move(image)).second)
      refuse(
          formatted("lens %d has two images of %f s; a bracket gives a different --exposure-s before each image, "
                    "and --lens N before the images of another lens",
                    a.lens, exposure_s));
  }
  const auto& [first_lens, first] = *out.images.begin();
  const auto same = [](const auto& a, const auto& b) { return std::abs(a.first - b.first) <= 1e-6 * b.first; };
  for (const auto& [lens, taken] : out.images)
    if (!std::equal(taken.begin(), taken.end(), first.begin(), first.end(), same))
      refuse(formatted("lens %d and lens %d have different exposures; give every lens the same list of --exposure-s",
                       lens, first_lens));
  if (first.size() > kMaxBracket)
    refuse(formatted("a bracket has at most %d exposures, this one has %zu", int{kMaxBracket}, first.size()));

  for (const auto& [exposure_s, image] : first) {
    FrameInfo& info = out.frames.emplace_back().info;
    info.sequence = out.frames.size();
    info.exposure_s = exposure_s;
    info.bracket_index = static_cast<int>(out.frames.size()) - 1;
    info.bracket_size = static_cast<int>(first.size());
  }
  out.rig.nits_per_unit = rig.nits_per_unit;
  for (const auto& [lens, taken] : out.images) {
    const int number = static_cast<int>(out.rig.lenses.size());
    out.rig.lenses.push_back(rig.lenses[static_cast<std::size_t>(lens)]);
    auto frame = out.frames.begin();
    for (const auto& [exposure_s, image] : taken) (frame++)->add_view(view_of(image, number));
  }
  return out;
}

std::unique_ptr<Estimator> make_estimator(const Arguments& arguments, const RigParameters& rig) {
  if (arguments.body.empty()) {
    PanoramaOptions options;
    options.config = arguments.config;
    options.probe_id = fnv1a_32("lightwell-estimate");
    return require(make_panorama_estimator(rig, options));
  }
  const MarkerBody body = require(load_marker_body(arguments.body));
  MarkerOptions options;
  options.config = arguments.config;
  options.probe_id = fnv1a_32("lightwell-estimate");
  return require(make_marker_estimator(rig, body, require(make_tag_body_finder(rig, body)), options));
}

/// The descriptor of the last picture of the plane.
Descriptor plane_descriptor(const Arguments& arguments) {
  constexpr std::int64_t kInterval_ns = 33'333'333;
  const RigParameters rig = require(load_calibration(arguments.calibration));
  const GlossyPlane plane = require(load_glossy_plane(arguments.plane));
  if (arguments.images.empty()) refuse("no image is given");
  SpecularOptions options;
  options.config = arguments.config;
  options.probe_id = fnv1a_32("lightwell-estimate");
  const std::unique_ptr<SpecularEstimator> estimator =
      require(make_specular_estimator(rig, plane, require(make_tag_body_finder(rig, plane.body())), options));
  Descriptor descriptor;
  std::size_t found = 0, number = 0;
  std::optional<std::size_t> last;
  std::string reason;
  const auto estimate = [&](std::size_t index) {
    const ImageArgument& a = arguments.images[index];
    const Image image = require(read_lens_image(a.path, rig, a.lens));
    Frame frame;
    frame.info.sequence = index + 1;
    frame.info.exposure_s = a.exposure_s > 0 ? a.exposure_s : 1;
    frame.info.mid_exposure.ns = static_cast<std::int64_t>(number++) * kInterval_ns;
    frame.add_view(view_of(image, a.lens));
    const Status status = estimator->estimate({&frame, 1}, descriptor);
    if (!status.ok() && status.code() != StatusCode::not_found) require(status.in(a.path));
    if (!status.ok()) reason = status.message();
    return status.ok();
  };
  for (std::size_t k = 0; k < arguments.images.size(); ++k) {
    if (k > 0 && k % 100 == 0)
      std::cerr << "lightwell-estimate: picture " << k << " of " << arguments.images.size() << "\n";
    if (estimate(k)) ++found, last = k;
  }
  if (!last) refuse("no picture shows the plane: " + reason);
  std::cerr << "lightwell-estimate: the plane was found in " << found << " of " << arguments.images.size()
            << " pictures\n";
  estimator->finish();
  if (!estimate(*last)) refuse(arguments.images[*last].path + ": " + reason);
  return descriptor;
}

Descriptor descriptor_of(const Arguments& arguments) {
  if (!arguments.plane.empty()) return plane_descriptor(arguments);
  std::vector<ImageArgument> images = arguments.images;
  RigParameters rig;
  if (!arguments.equirect.empty()) {
    const Image image = require(read_image(arguments.equirect));
    if (image.width != 2 * image.height)
      refuse(arguments.equirect +
             formatted(": an equirectangular panorama is twice as wide as high, this one has %dx%d pixels", image.width,
                       image.height));
    rig.lenses = {
        {image.width, image.height, EquirectangularParameters{}, std::numbers::pi, {upright_lens_cv(), {}}, {}}};
    rig.lenses[0].photometry.response.kind = ResponseCurve::Kind::srgb;
    images = {{arguments.equirect, 0, 0}};
  } else {
    rig = require(load_calibration(arguments.calibration));
  }
  const ImageBracket bracket = read_bracket(rig, images);
  if (bracket.invalid_values > 0)
    std::cerr << "lightwell-estimate: " << bracket.invalid_values
              << " values are negative, NaN or infinite and were replaced (flag CLEANED)\n";
  Descriptor descriptor;
  require(make_estimator(arguments, bracket.rig)->estimate(bracket.frames, descriptor));
  return descriptor;
}

void print_summary(const Descriptor& d, std::size_t bytes) {
  const double degree = 180 / std::numbers::pi;
  std::cout << "harmonics to band " << d.radiance.band << ", " << d.lights.size() << " lights, " << bytes
            << " bytes; sees " << 100 * d.coverage << " % of the sphere; bound " << 100 * d.bound.total << " %";
  for (const Flag f : kFlags)
    if (d.flags.has(f)) std::cout << "; " << to_string(f);
  std::cout << "\n";
  for (const Light& l : d.lights) {
    std::cout << "light towards (" << l.direction.x << ", " << l.direction.y << ", " << l.direction.z
              << "), irradiance (" << l.irradiance.r << ", " << l.irradiance.g << ", " << l.irradiance.b << "), radius "
              << l.angular_radius_rad * degree << " deg";
    if (const std::optional<Vec3d> at = light_position(l, d.T_probe_origin))
      std::cout << ", distance " << l.distance_m << " +- " << l.distance_sigma_m << " m, position (" << at->x << ", "
                << at->y << ", " << at->z << ") m";
    std::cout << "\n";
  }
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app{"Estimates the lighting of a place from still images.", "lightwell-estimate"};
  app.footer(kFooter);
  Arguments in;
  std::vector<std::string> paths;
  std::vector<int> lenses;
  std::vector<double> exposures;
  const CLI::Option* images =
      app.add_option("IMAGES", paths, "Images, read in order; --lens and --exposure-s apply to the images after them");
  app.add_option("--calibration", in.calibration,
                 "The camera's calibration (proto/lightwell/v1/calibration.proto, text format)");
  app.add_option("--equirect", in.equirect, "A whole panorama; needs no calibration (PNG and JPEG: sRGB response)");
  const CLI::Option* lens = app.add_option("--lens", lenses, "Lens of the rig that the images after it belong to [0]")
                                ->allow_extra_args(false)
                                ->check(CLI::NonNegativeNumber);
  const CLI::Option* exposure =
      app.add_option("--exposure-s", exposures,
                     "Exposure of the next image in seconds; a bracket gives one before each image")
          ->allow_extra_args(false)
          ->check(number_where("above 0", [](double s) { return s > 0; }));
  app.add_option("--body", in.body,
                 "Estimate light from this marker in the picture (the file of lightwell-calibrate marker-sheet)");
  app.add_option("--plane", in.plane,
                 "Estimate light from this glossy plane in the pictures (a GlossyPlane, "
                 "proto/lightwell/v1/glossy_plane.proto)");
  app.add_option("--json", in.json, "Write the descriptor as protobuf JSON; - is standard output");
  app.add_option("--binary", in.binary, "Write the encoded descriptor (wire format)");
  app.add_option("--band", in.config.band, "Highest band of the harmonics, 0 to 6 [4]");
  app.add_option("--max-lights", in.config.max_lights, "Maximum number of lights, 0 to 64 [8]");
  return run_command(app, {argv + 1, argv + argc}, [&] {
    ImageArgument next;
    for (const auto& [option, index] : in_order(app)) {
      if (option == lens) next.lens = lenses[index];
      if (option == exposure) next.exposure_s = exposures[index];
      if (option != images) continue;
      next.path = paths[index];
      in.images.push_back(next);
      next.exposure_s = 0;
    }
    if (next.exposure_s > 0)
      throw UsageError(in.equirect.empty() ? "--exposure-s has no image after it; it applies to the next one"
                                           : "--equirect takes one image without exposure; a bracket of panoramas "
                                             "needs --calibration with equirectangular {}");
    check(in);
    const Descriptor descriptor = descriptor_of(in);
    Encoder encoder;
    const std::span<const std::byte> bytes = require(encoder.encode(descriptor));
    if (!in.binary.empty())
      require(write_output(in.binary, {reinterpret_cast<const char*>(bytes.data()), bytes.size()}));
    if (!in.json.empty())
      require(write_output(in.json, require(descriptor_to_json(bytes)) + "\n"));
    else if (in.binary.empty())
      print_summary(descriptor, bytes.size());
    return kDone;
  });
}
