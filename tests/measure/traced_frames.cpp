#include "measure/traced_frames.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <map>
#include <numbers>
#include <optional>
#include <utility>

#include <google/protobuf/struct.pb.h>
#include <google/protobuf/util/json_util.h>

#include <lightwell/files.hpp>
#include <lightwell/query.hpp>

#include "calibration/model/camera_model.hpp"
#include "imaging/image_file.hpp"

namespace lightwell::measure {

namespace {

using google::protobuf::Struct;
using google::protobuf::Value;

/// Reads fields of one frame and stores the name of the first field that is missing or has the wrong type.
class Fields {
 public:
  explicit Fields(const Struct& s) : struct_(&s) {}

  [[nodiscard]] const Value* find(const std::string& name) const {
    const auto found = struct_->fields().find(name);
    return found == struct_->fields().end() ? nullptr : &found->second;
  }
  double number(const std::string& name) {
    const Value* v = find(name);
    return v != nullptr && v->has_number_value() ? v->number_value() : lack(name, 0.0);
  }
  std::string text(const std::string& name) {
    const Value* v = find(name);
    return v != nullptr && v->has_string_value() ? v->string_value() : lack(name, std::string());
  }
  template <std::size_t N>
  std::array<double, N> numbers(const std::string& name) {
    const Value* v = find(name);
    std::array<double, N> out{};
    if (v == nullptr || !v->has_list_value() || v->list_value().values_size() != static_cast<int>(N))
      return lack(name, out);
    for (std::size_t k = 0; k < N; ++k) out[k] = v->list_value().values(static_cast<int>(k)).number_value();
    return out;
  }
  Vec3d vector(const std::string& name) {
    const auto v = numbers<3>(name);
    return {v[0], v[1], v[2]};
  }
  Fields inside(const std::string& name) {
    const Value* v = find(name);
    if (v == nullptr || !v->has_struct_value()) return lack(name, Fields(Struct::default_instance()));
    return Fields(v->struct_value());
  }
  void take_lack_of(const Fields& other) {
    if (lacking.empty()) lacking = other.lacking;
  }

  std::string lacking;

 private:
  template <class T>
  T lack(const std::string& name, T instead) {
    if (lacking.empty()) lacking = name;
    return instead;
  }
  const Struct* struct_;
};

std::string view_of(double turn_deg) {
  if (std::abs(turn_deg) < 1e-6) return "straight";
  return std::abs(turn_deg - 36) < 1e-6 ? "turned" : "other";
}

std::string place_of(double azimuth_deg) {
  static const std::map<int, std::string> names{
      {0, "front"}, {45, "front_right"}, {90, "right"}, {135, "back_right"}, {180, "behind"}};
  const auto found = names.find(static_cast<int>(std::lround(azimuth_deg)));
  return found == names.end() || std::abs(azimuth_deg - found->first) > 1e-6 ? "other" : found->second;
}

TracedLamp lamp_of(Fields& of) {
  TracedLamp lamp;
  lamp.direction = normalized(of.vector("direction"));
  lamp.position = of.vector("position_m");
  lamp.distance_m = of.number("distance_m");
  lamp.irradiance = of.numbers<3>("irradiance_rgb");
  const Value* lit = of.find("seen_faces_lit");
  lamp.visible_lit_faces = lit == nullptr ? 0 : lit->list_value().values_size();
  return lamp;
}

std::vector<std::array<double, 3>> triples_of(const Value* list) {
  std::vector<std::array<double, 3>> out;
  if (list == nullptr) return out;
  for (const Value& v : list->list_value().values()) {
    std::array<double, 3>& one = out.emplace_back();
    for (int k = 0; k < std::min(3, v.list_value().values_size()); ++k)
      one[static_cast<std::size_t>(k)] = v.list_value().values(k).number_value();
  }
  return out;
}

void read_room(Fields& of, TracedFrame& frame) {
  Fields room = of.inside("panorama");
  Fields strongest = room.inside("strongest");
  TracedLamp lamp;
  lamp.direction = normalized(strongest.vector("direction"));
  lamp.irradiance = strongest.numbers<3>("vector_irradiance_rgb");
  const Value* lit = strongest.find("seen_faces_lit");
  lamp.visible_lit_faces = lit == nullptr ? 0 : lit->list_value().values_size();
  frame.strongest_share = strongest.number("share_of_irradiance_facing_it");
  frame.lamps = {lamp};
  for (const auto& n : triples_of(room.find("normals"))) frame.normals.push_back(normalized(Vec3d{n[0], n[1], n[2]}));
  frame.irradiance = triples_of(room.find("irradiance_rgb"));
  if (frame.irradiance.size() != frame.normals.size()) room.lacking = "panorama.irradiance_rgb";
  of.take_lack_of(strongest);
  of.take_lack_of(room);
}

Result<TracedFrame> frame_of(const std::string& name, const Struct& s) {
  Fields of(s);
  TracedFrame frame;
  frame.name = name;
  frame.file = of.text("file");
  frame.group = of.text("group");
  frame.body = of.text("body");
  frame.view = view_of(of.number("turn_about_y_deg"));

  Fields camera = of.inside("camera"), pose = of.inside("T_probe_body");
  LensParameters lens;
  lens.width = static_cast<int>(camera.number("width"));
  lens.height = static_cast<int>(camera.number("height"));
  MeiParameters pinhole;
  pinhole.fx = camera.number("fx_px");
  pinhole.fy = camera.number("fy_px");
  pinhole.cx = camera.number("cx_px");
  pinhole.cy = camera.number("cy_px");
  lens.model = pinhole;
  // Any useful pinhole has its image corners within this angle.
  lens.max_angle_rad = 1.2;
  lens.pose_cv = {upright_lens_cv(), {}};
  frame.rig.lenses = {lens};
  const auto q = pose.numbers<4>("q_xyzw");
  frame.probe_body = {Quat{q[0], q[1], q[2], q[3]}.normalized(), pose.vector("t_m")};
  of.take_lack_of(camera);
  of.take_lack_of(pose);

  if (const Value* board = of.find("board"); board != nullptr && board->has_struct_value()) {
    Fields b(board->struct_value());
    frame.board = {b.vector("center_m"), normalized(b.vector("normal")), normalized(b.vector("x")),
                   b.numbers<2>("size_m"), b.number("albedo")};
    of.take_lack_of(b);
  }
  frame.place = "other";
  const Value* lamps = of.find("lamps");
  for (const Value& v : (lamps == nullptr ? Value::default_instance() : *lamps).list_value().values()) {
    Fields lamp(v.struct_value());
    if (frame.lamps.empty()) frame.place = place_of(lamp.number("azimuth_deg"));
    frame.lamps.push_back(lamp_of(lamp));
    of.take_lack_of(lamp);
  }
  frame.ambient_radiance = of.numbers<3>("ambient_radiance_rgb");
  if (of.find("panorama") != nullptr) read_room(of, frame);
  if (!of.lacking.empty()) return Status(StatusCode::data_loss, "scenes.json: " + name + " lacks " + of.lacking);
  if (const Status ok = frame.rig.validate(); !ok.ok())
    return Status(ok.code(), "scenes.json: " + name + ": " + ok.message());
  return frame;
}

/// Whether a pixel lies at least `margin_px` inside a convex outline of either orientation.
bool inside(const std::vector<PixelPosition>& outline, double x, double y, double margin_px) {
  double area = 0;
  for (std::size_t k = 0; k < outline.size(); ++k) {
    const PixelPosition &a = outline[k], &b = outline[(k + 1) % outline.size()];
    area += a.x * b.y - b.x * a.y;
  }
  for (std::size_t k = 0; k < outline.size(); ++k) {
    const PixelPosition &a = outline[k], &b = outline[(k + 1) % outline.size()];
    const double across = ((b.x - a.x) * (y - a.y) - (b.y - a.y) * (x - a.x)) / std::hypot(b.x - a.x, b.y - a.y);
    if ((area > 0 ? across : -across) < margin_px) return false;
  }
  return true;
}

/// Mean of the largest channel over the pixels inside; none for fewer than 20 pixels.
std::optional<double> mean_inside(const std::vector<float>& rgb, int width, int height,
                                  const std::vector<PixelPosition>& outline) {
  double left = width, right = 0, top = height, bottom = 0;
  for (const PixelPosition& p : outline) {
    left = std::min(left, p.x), right = std::max(right, p.x);
    top = std::min(top, p.y), bottom = std::max(bottom, p.y);
  }
  std::array<double, 3> sum{};
  int count = 0;
  for (int y = std::max(0, static_cast<int>(top)); y <= std::min<double>(height - 1, bottom); ++y)
    for (int x = std::max(0, static_cast<int>(left)); x <= std::min<double>(width - 1, right); ++x) {
      if (!inside(outline, x, y, 1.5)) continue;
      const auto pixel = static_cast<std::size_t>(y) * static_cast<std::size_t>(width) + static_cast<std::size_t>(x);
      for (std::size_t c = 0; c < 3; ++c) sum[c] += rgb[3 * pixel + c];
      ++count;
    }
  if (count < 20) return std::nullopt;
  return *std::max_element(sum.begin(), sum.end()) / count;
}

double white_of(const std::vector<float>& rgb, const TracedFrame& frame, const MarkerBody& body) {
  const LensParameters& lens = frame.rig.lenses.front();
  const CameraModel model(lens);
  const Pose lens_body = compose(inverse(lens.pose_cv), frame.probe_body);
  const auto white = [](const MarkerPatch& p) { return *std::max_element(p.albedo.begin(), p.albedo.end()); };
  double whitest = 0, best = 0;
  for (const MarkerFace& face : body.faces)
    for (const MarkerPatch& patch : face.patches) whitest = std::max(whitest, white(patch));
  for (const MarkerFace& face : body.faces) {
    const Pose lens_face = compose(lens_body, face.body_face);
    if (dot(rotate(lens_face.rotation, Vec3d{0, 0, 1}), lens_face.translation) >= 0) continue;
    for (const MarkerPatch& patch : face.patches) {
      if (white(patch) < whitest - 1e-9) continue;
      std::vector<PixelPosition> outline;
      for (const FacePoint& p : patch.outline)
        if (const auto pixel = model.project(transformed(lens_face, {p.x, p.y, 0}))) outline.push_back(*pixel);
      if (outline.size() != patch.outline.size()) continue;
      best = std::max(best, mean_inside(rgb, lens.width, lens.height, outline).value_or(0));
    }
  }
  return best;
}

}  // namespace

Result<std::vector<TracedFrame>> load_traced_frames(const std::string& folder) {
  const std::string path = folder + "/scenes.json";
  const Result<std::string> text = read_text_file(path);
  if (!text) return text.status();
  Struct all;
  if (const auto s = google::protobuf::util::JsonStringToMessage(*text, &all); !s.ok())
    return Status(StatusCode::data_loss, path + ": " + std::string(s.message()));
  Fields of(all);
  const Value* frames = of.find("frames");
  if (frames == nullptr || !frames->has_struct_value()) return Status(StatusCode::data_loss, path + ": lacks frames");
  std::vector<TracedFrame> out;
  for (const auto& [name, value] : frames->struct_value().fields()) {
    Result<TracedFrame> frame = frame_of(name, value.struct_value());
    if (!frame) return frame.status();
    out.push_back(std::move(*frame));
  }
  // protobuf's map is unordered.
  std::sort(out.begin(), out.end(), [](const TracedFrame& a, const TracedFrame& b) { return a.name < b.name; });
  return out;
}

Result<std::map<std::string, MarkerBody>> load_traced_bodies(const std::string& folder) {
  std::map<std::string, MarkerBody> bodies;
  for (const char* variant : {"white", "grey"}) {
    auto body = load_marker_body(folder + "/dodecahedron_100mm_" + variant + ".textproto");
    if (!body) return body.status();
    bodies.emplace(variant, std::move(*body));
  }
  return bodies;
}

std::vector<std::array<double, 3>> true_irradiance(const TracedFrame& frame, std::span<const Vec3d> normals) {
  constexpr int kDirections = 10'000;
  /// What the board changes in the radiance from a direction.
  struct Difference {
    Vec3d direction;
    std::array<double, 3> radiance{};
  };
  std::vector<Difference> by_board;
  for (int i = 0; frame.board && i < kDirections; ++i) {
    const TracedBoard& board = *frame.board;
    const Vec3d d = fibonacci_direction(i, kDirections), to_board = board.center - frame.probe_body.translation;
    if (!(dot(d, board.normal) < 0)) continue;
    const Vec3d at = d * (dot(to_board, board.normal) / dot(d, board.normal)), on_board = at - to_board;
    if (std::abs(dot(on_board, board.x)) > board.size_m[0] / 2 ||
        std::abs(dot(on_board, cross(board.normal, board.x))) > board.size_m[1] / 2)
      continue;
    Difference& difference = by_board.emplace_back();
    difference.direction = d;
    for (std::size_t c = 0; c < 3; ++c) {
      double irradiance = std::numbers::pi * frame.ambient_radiance[c];
      for (const TracedLamp& lamp : frame.lamps) {
        const Vec3d to_lamp = lamp.direction * lamp.distance_m - at;
        irradiance += lamp.irradiance[c] * std::pow(lamp.distance_m, 2) * std::max(0.0, dot(to_lamp, board.normal)) /
                      std::pow(length(to_lamp), 3);
      }
      difference.radiance[c] = board.albedo / std::numbers::pi * irradiance - frame.ambient_radiance[c];
    }
  }
  std::vector<std::array<double, 3>> out;
  for (const Vec3d& normal : normals) {
    std::array<double, 3>& sum = out.emplace_back();
    for (std::size_t c = 0; c < 3; ++c) {
      sum[c] = std::numbers::pi * frame.ambient_radiance[c];
      for (const TracedLamp& lamp : frame.lamps)
        sum[c] += lamp.irradiance[c] * std::max(0.0, dot(lamp.direction, normal));
      for (const Difference& one : by_board)
        sum[c] += one.radiance[c] * std::max(0.0, dot(one.direction, normal)) * 4 * std::numbers::pi / kDirections;
    }
  }
  return out;
}

TrueIrradiance irradiance_facing_camera(const TracedFrame& frame) {
  if (!frame.normals.empty()) return {frame.normals, frame.irradiance};
  constexpr int kNormals = 2048;
  const Vec3d to_camera = normalized(-frame.probe_body.translation);
  TrueIrradiance out;
  for (int i = 0; i < kNormals; ++i)
    if (const Vec3d n = fibonacci_direction(i, kNormals); dot(n, to_camera) > 0.5) out.normals.push_back(n);
  out.irradiance = true_irradiance(frame, out.normals);
  return out;
}

double irradiance_error(const TrueIrradiance& truth, const Descriptor& answer) {
  double squares = 0, all = 0;
  for (std::size_t i = 0; i < truth.normals.size(); ++i) {
    const Irradiance e = irradiance_at(answer, vec_cast<float>(truth.normals[i]));
    const std::array<double, 3> estimate = {e.r, e.g, e.b};
    for (std::size_t c = 0; c < 3; ++c)
      squares += std::pow(estimate[c] - truth.irradiance[i][c], 2), all += std::pow(truth.irradiance[i][c], 2);
  }
  return std::sqrt(squares / all);
}

Result<TracedPicture> TracedPicture::load(const std::string& folder, const TracedFrame& frame, const MarkerBody& body) {
  const std::string path = folder + "/" + frame.file;
  const Result<Image> image = read_image(path);
  if (!image) return image.status();
  const LensParameters& lens = frame.rig.lenses.front();
  if (image->format != PixelFormat::rgb_f32 || image->width != lens.width || image->height != lens.height)
    return Status(StatusCode::data_loss, path + ": not the floats of the size that scenes.json says");
  TracedPicture picture;
  picture.rig_ = frame.rig;
  picture.radiance_.emplace_back(image->data.size() / sizeof(float));
  std::memcpy(picture.radiance_.front().data(), image->data.data(), image->data.size());
  picture.white_ = white_of(picture.radiance_.front(), frame, body);
  if (!(picture.white_ > 0)) return Status(StatusCode::data_loss, path + ": no white patch of the body is in view");
  return picture;
}

RigParameters TracedPicture::rig_for(const TracedSensor& sensor) const {
  RigParameters rig = rig_;
  PhotometricCalibration& p = rig.lenses.front().photometry;
  p.response.kind = sensor.srgb ? ResponseCurve::Kind::srgb : ResponseCurve::Kind::linear;
  p.read_noise = sensor.read_noise;
  p.shot_noise = sensor.electrons > 0 ? 1 / sensor.electrons : 0;
  return rig;
}

Shot TracedPicture::expose(const TracedSensor& sensor, std::uint64_t number) const {
  const double exposure[] = {sensor.white_level / white_};
  return Camera(rig_for(sensor), PixelFormat::rgb8).expose(radiance_, exposure, number);
}

}  // namespace lightwell::measure
