// marker_picture: renders a marker body in known light to a PNG and prints the ground truth.
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <exception>
#include <iostream>
#include <sstream>
#include <string>
#include <utility>
#include <vector>

#include <CLI/CLI.hpp>
#include <nlohmann/json.hpp>

#include <lightwell/marker_body.hpp>

#include "imaging/image_file.hpp"
#include "reference/marker/marker_exposure.hpp"
#include "reference/marker/marker_picture.hpp"
#include "reference/marker/marker_scene.hpp"
#include "reference/marker/marker_stage.hpp"

namespace lightwell::reference {
namespace {

/// Exit codes: the footer of --help.
enum Exit : int { kOk = 0, kFailed = 1, kUsage = 2 };

constexpr double kDegree = pi / 180;

struct Wishes {
  std::string body, out = "marker.png";
  std::vector<int> size{640, 480};
  double focal_px = 700, elevation_deg = 30, turn_deg = 0, distance_m = 0.6;
  std::vector<std::string> lamps{"30,45,0,1"};
  double lamp_radius_m = 0, ambient = 0.05, table = 0.1;
  double full_scale = 0.5, electrons = 10'000, blur_px = 0.5;
  int samples = 3, threads = 1, stands_on = -1;
  std::uint64_t seed = 1;
  bool grey = false, linear = false, json = false;
};

int fail(const std::string& what, Exit code) {
  std::cerr << "marker_picture: " << what << "\n";
  return code;
}

/// The tag of the face that points down most.
int lowest_tag(const MarkerBody& body) {
  const auto down = [](const MarkerFace& face) { return -rotate(face.body_face.rotation, Vec3d{0, 0, 1}).y; };
  const MarkerFace* lowest = &body.faces.front();
  for (const MarkerFace& face : body.faces)
    if (down(face) > down(*lowest)) lowest = &face;
  return lowest->tag_id;
}

/// Parses AZIMUTH,ELEVATION,DISTANCE,LIGHT or ...,R,G,B; std::nullopt for anything else.
std::vector<double> parameters_of(const std::string& text) {
  std::vector<double> out;
  std::istringstream in(text);
  for (std::string one; std::getline(in, one, ',');) {
    char* end = nullptr;
    out.push_back(std::strtod(one.c_str(), &end));
    if (one.empty() || *end != '\0') return {};
  }
  return out.size() == 4 || out.size() == 6 ? out : std::vector<double>{};
}

MarkerScene scene_of(const MarkerBody& body, const MarkerStage& stage, const Wishes& w) {
  MarkerScene scene;
  scene.body = body;
  scene.probe_body = stage.probe_body();
  scene.ambient = even_ambient({w.ambient, w.ambient, w.ambient});
  for (const std::string& text : w.lamps) {
    const std::vector<double> l = parameters_of(text);
    const std::size_t colour = l.size() == 6 ? 1 : 0;
    const Rgb light{l[3], l[3 + colour], l[3 + 2 * colour]};
    if (l[2] > 0)
      scene.lamps.push_back(NearLamp{stage.place(l[0] * kDegree, l[1] * kDegree, l[2]), light, w.lamp_radius_m});
    else
      scene.lamps.push_back(DistantLamp{stage.direction(l[0] * kDegree, l[1] * kDegree), light});
  }
  if (w.table > 0) {
    const Rgb albedo{w.table, w.table, w.table};
    scene.table = table_under(body, scene.probe_body, w.stands_on >= 0 ? w.stands_on : lowest_tag(body), albedo);
    // A body with a single face has no face to stand on.
    if (dot(scene.table->normal, stage.up()) < 0) scene.table.reset();
  }
  return scene;
}

void print_truth(const MarkerScene& scene, const MarkerCamera& camera) {
  nlohmann::ordered_json out = {
      {"body", scene.body.name}, {"lamps", nlohmann::ordered_json::array()}, {"tags", nlohmann::ordered_json::array()}};
  for (const LampTruth& lamp : lamp_truths(scene)) {
    const Vec3d &p = lamp.direction_probe, &b = lamp.direction_body;
    nlohmann::ordered_json truth = {{"direction_probe", std::array{p.x, p.y, p.z}},
                                    {"direction_body", std::array{b.x, b.y, b.z}}};
    // JSON cannot represent infinity.
    if (std::isfinite(lamp.distance_m)) truth["distance_m"] = lamp.distance_m;
    truth["irradiance"] = lamp.irradiance;
    out["lamps"].push_back(std::move(truth));
  }
  for (std::size_t k = 0; k < scene.body.faces.size(); ++k) {
    const auto corners = tag_corners(scene, camera, k);
    if (!corners) continue;
    nlohmann::ordered_json corners_px = nlohmann::ordered_json::array();
    for (const auto& corner : *corners) corners_px.push_back(std::array{corner.x, corner.y});
    out["tags"].push_back({{"tag", scene.body.faces[k].tag_id},
                           {"corners_px", std::move(corners_px)},
                           {"irradiance", face_irradiance(scene, k, {}).total()}});
  }
  std::cout << out.dump(-1, ' ', true, nlohmann::ordered_json::error_handler_t::replace) << std::endl;
}

Image image_of(const RadiancePicture& radiance, const Wishes& w) {
  ExposureOptions exposure;
  exposure.full_scale = w.full_scale;
  exposure.electrons = w.electrons;
  exposure.srgb = !w.linear;
  exposure.seed = w.seed;
  Image image;
  image.width = radiance.width;
  image.height = radiance.height;
  if (w.grey) {
    for (const std::uint8_t code : expose_grey(radiance, exposure).pixels)
      image.data.insert(image.data.end(), 3, std::byte{code});
  } else {
    for (const std::uint8_t code : expose(radiance, exposure).rgb) image.data.push_back(std::byte{code});
  }
  return image;
}

int draw(const Wishes& w) {
  const Result<MarkerBody> body = load_marker_body(w.body);
  if (!body) return fail(body.status().message(), kFailed);
  const MarkerStage stage{w.distance_m, w.elevation_deg * kDegree, w.turn_deg * kDegree};
  const MarkerScene scene = scene_of(*body, stage, w);
  const MarkerCamera camera(pinhole_lens(w.size[0], w.size[1], w.focal_px));
  RenderOptions options;
  options.samples = w.samples;
  options.blur_px = w.blur_px;
  options.threads = w.threads;
  if (const Status s = write_png(w.out, image_of(render(scene, camera, options), w)); !s.ok())
    return fail(s.message(), kFailed);
  if (w.json) print_truth(scene, camera);
  std::cerr << "marker_picture: drew " << w.out << "\n";
  return kOk;
}

}  // namespace
}  // namespace lightwell::reference

int main(int argc, char** argv) {
  using namespace lightwell::reference;
  CLI::App app{"marker_picture draws a marker body in known light, by the oracle that tests use, as a PNG."};
  app.footer(
      "Azimuths go round the body as it stands: 0 towards the camera, 90 to its right, 180 behind the body.\n"
      "Examples (B=firmware/estimate/marker/bodies):\n"
      "  marker_picture $B/dodecahedron_100mm_grey.textproto --lamp 45,35,0.61,0.3\n"
      "  marker_picture $B/cube_60mm_grey.textproto --turn 30 --lamp 90,40,0,1,0.6,0.3 --lamp -60,30,0,0.1,0.2,0.5 "
      "--json\n"
      "Exit status: 0 drawn, 1 an input or output failed, 2 wrong usage.");
  Wishes w;
  const auto range = [](double low, double high) { return CLI::Range(low, high); };
  app.add_option("body", w.body, "A body file (firmware/estimate/marker/bodies)")->required();
  app.add_option("-o,--out", w.out, "The picture [marker.png]");
  app.add_option("--size", w.size, "Width and height, px [640 480]")->expected(2)->check(CLI::Range(8, 8192));
  app.add_option("--focal", w.focal_px, "Focal length of the pinhole, px [700]")->check(range(1, 1e5));
  app.add_option("--distance", w.distance_m, "From camera to body, m [0.6]")->check(range(0.01, 100));
  app.add_option("--elevation", w.elevation_deg, "Of the camera above the table, degrees [30]")->check(range(-90, 90));
  app.add_option("--turn", w.turn_deg, "Of the body about its upright axis, degrees [0]");
  app.add_option(
         "--lamp", w.lamps,
         "AZIMUTH,ELEVATION,DISTANCE,LIGHT or R,G,B for LIGHT; degrees, and m from the body's middle. DISTANCE 0: a\n"
         "distant one, LIGHT its irradiance; else LIGHT is intensity, and irradiance LIGHT / DISTANCE^2.\n"
         "Again for more lamps [30,45,0,1]")
      ->allow_extra_args(false)
      ->check([](const std::string& text) {
        return parameters_of(text).empty() ? "'" + text + "' is not AZIMUTH,ELEVATION,DISTANCE,LIGHT" : std::string();
      });
  app.add_option("--lamp-radius", w.lamp_radius_m, "Of near lamps, m: penumbras [0]")->check(range(0, 10));
  app.add_option("--ambient", w.ambient, "Radiance from everywhere [0.05]")->check(range(0, 1e9));
  app.add_option("--table", w.table, "Its albedo; 0: none [0.1]")->check(range(0, 1));
  app.add_option("--stands-on", w.stands_on, "Tag of the face that lies on the table [the one that looks down most]");
  app.add_option("--full-scale", w.full_scale, "Radiance that fills the scale [0.5]")->check(range(1e-9, 1e9));
  app.add_option("--electrons", w.electrons, "That fill the scale; 0: no noise [10000]")->check(range(0, 1e9));
  app.add_option("--blur", w.blur_px, "Deviation of a Gaussian, px [0.5]")->check(range(0, 100));
  app.add_option("--samples", w.samples, "Squared, rays a pixel away from edges [3]")->check(CLI::Range(2, 32));
  app.add_option("--threads", w.threads, "[1]")->check(CLI::Range(1, 64));
  app.add_option("--seed", w.seed, "Of the noise [1]");
  app.add_flag("--grey", w.grey, "A camera without colour");
  app.add_flag("--linear", w.linear, "Bytes are linear, not sRGB");
  app.add_flag("--json", w.json, "What is true on stdout: lamps from the body's middle, tags' corners, light on faces");
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& e) {
    return app.exit(e) == 0 ? kOk : kUsage;
  }
  try {
    return draw(w);
  } catch (const std::exception& e) {
    return fail(e.what(), kFailed);
  }
}
