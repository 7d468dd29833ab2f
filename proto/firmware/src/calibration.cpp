#include <algorithm>
#include <cmath>
#include <numbers>

#include <lightwell/calibration.hpp>
#include <lightwell/descriptor.hpp>

#include "messages.hpp"
#include "text_message.hpp"

namespace lightwell {
namespace {

constexpr double kDegree = std::numbers::pi / 180;

/// The parameters of a model in the order of the fields of its message.
constexpr auto members_of(const KannalaBrandtParameters&) {
  using P = KannalaBrandtParameters;
  return std::array{&P::fx, &P::fy, &P::cx, &P::cy, &P::k1, &P::k2, &P::k3, &P::k4};
}
constexpr auto members_of(const DoubleSphereParameters&) {
  using P = DoubleSphereParameters;
  return std::array{&P::fx, &P::fy, &P::cx, &P::cy, &P::xi, &P::alpha};
}
constexpr auto members_of(const MeiParameters&) {
  using P = MeiParameters;
  return std::array{&P::fx, &P::fy, &P::cx, &P::cy, &P::xi, &P::k1, &P::k2, &P::p1, &P::p2};
}

template <class Model>
Model model_from(const google::protobuf::Message& m) {
  Model out;
  int field = 0;
  for (const auto member : members_of(out))
    out.*member = m.GetReflection()->GetDouble(m, m.GetDescriptor()->field(field++));
  return out;
}

template <class Model>
void fill_model(const Model& model, google::protobuf::Message& m) {
  int field = 0;
  for (const auto member : members_of(model))
    m.GetReflection()->SetDouble(&m, m.GetDescriptor()->field(field++), model.*member);
}

/// Checks what the models have in common.
template <class Model>
Status parameter_problem(const Model& model, const std::string& name) {
  for (const auto member : members_of(model))
    if (!std::isfinite(model.*member)) return invalid_argument(name + " has a value that is not finite");
  if (!(model.fx > 0) || !(model.fy > 0)) return invalid_argument(name + ".fx and fy must be positive");
  return {};
}

Status model_problem(const LensParameters& lens) {
  if (const auto* p = std::get_if<KannalaBrandtParameters>(&lens.model)) {
    if (const Status s = parameter_problem(*p, "kannala_brandt"); !s.ok()) return s;
    // The radius must increase with the angle over the whole field of view, so that each pixel has one direction.
    for (int i = 0; i <= 256; ++i) {
      const double t = lens.max_angle_rad * i / 256, t2 = t * t;
      if (!(1 + t2 * (3 * p->k1 + t2 * (5 * p->k2 + t2 * (7 * p->k3 + t2 * 9 * p->k4))) > 0))
        return invalid_argument("kannala_brandt: the radius stops growing at " + std::to_string(t / kDegree) +
                                " deg, inside max_angle_deg; lower max_angle_deg or correct k1 to k4");
    }
  } else if (const auto* d = std::get_if<DoubleSphereParameters>(&lens.model)) {
    if (const Status s = parameter_problem(*d, "double_sphere"); !s.ok()) return s;
    if (!(d->alpha >= 0 && d->alpha <= 1)) return invalid_argument("double_sphere.alpha must be 0 to 1");
    if (!(d->xi > -1 && d->xi < 1)) return invalid_argument("double_sphere.xi must lie between -1 and 1");
  } else if (const auto* m = std::get_if<MeiParameters>(&lens.model)) {
    if (const Status s = parameter_problem(*m, "mei"); !s.ok()) return s;
    if (!(m->xi >= 0 && m->xi <= 100)) return invalid_argument("mei.xi must be 0 to 100");
  }
  return {};
}

Status photometry_problem(const PhotometricCalibration& p, double max_angle_rad) {
  const auto bad = [](const std::string& what) { return invalid_argument("photometry." + what); };
  if (!(p.black_level >= 0 && p.black_level < 0.5)) return bad("black_level must be at least 0 and below 0.5");
  if (!(p.saturation > p.black_level && p.saturation <= 1))
    return bad("saturation must lie above black_level, up to 1");
  if (!(p.read_noise >= 0) || !(p.shot_noise >= 0)) return bad("read_noise and shot_noise must not be negative");
  for (const double v : p.vignetting)
    if (!std::isfinite(v)) return bad("vignetting must be finite");
  for (const double v : p.white_balance)
    if (!(v > 0) || !std::isfinite(v)) return bad("white_balance must be positive");
  if (p.response.kind == ResponseCurve::Kind::table) {
    const auto& t = p.response.inverse;
    if (t.size() < 2) return bad("response.inverse needs at least two values");
    for (std::size_t i = 0; i < t.size(); ++i)
      if (!std::isfinite(t[i]) || (i > 0 && t[i] < t[i - 1]))
        return bad("response.inverse must increase; it does not at entry " + std::to_string(i));
    if (!(t.front() >= 0 && t.front() <= 0.1) || !(std::abs(t.back() - 1) <= 1e-3))
      return bad("response.inverse must increase from 0 (at most 0.1) to 1; it goes from " + std::to_string(t.front()) +
                 " to " + std::to_string(t.back()));
  }
  if (p.response.kind == ResponseCurve::Kind::gamma && !(p.response.gamma > 0 && std::isfinite(p.response.gamma)))
    return bad("response.gamma must be given and positive");
  for (int i = 0; i <= 64; ++i) {
    const double t = max_angle_rad * i / 64, t2 = t * t;
    const double v = 1 + t2 * (p.vignetting[0] + t2 * (p.vignetting[1] + t2 * p.vignetting[2]));
    if (!(v >= 0.05))
      return bad("vignetting leaves " + std::to_string(v) + " of the light at " + std::to_string(t / kDegree) +
                 " deg, inside max_angle_deg; it must leave at least 0.05");
  }
  return {};
}

RigParameters rig_from(const v1::RigCalibration& m) {
  RigParameters rig;
  rig.nits_per_unit = m.nits_per_unit();
  if (m.has_report()) rig.report = report_from(m.report());
  for (const v1::LensCalibration& in : m.lens()) {
    LensParameters lens;
    lens.width = static_cast<int>(in.width());
    lens.height = static_cast<int>(in.height());
    lens.max_angle_rad = in.max_angle_deg() * kDegree;
    if (in.has_equirectangular()) {
      lens.model = EquirectangularParameters{};
      lens.max_angle_rad = std::numbers::pi;
    } else if (in.has_double_sphere()) {
      lens.model = model_from<DoubleSphereParameters>(in.double_sphere());
    } else if (in.has_mei()) {
      lens.model = model_from<MeiParameters>(in.mei());
    } else {
      // Also without a model: validate() says that fx is missing.
      lens.model = model_from<KannalaBrandtParameters>(in.kannala_brandt());
    }
    lens.pose_cv.rotation = upright_lens_cv();
    if (in.has_pose()) lens.pose_cv = pose_from(in.pose());
    const v1::Photometry& p = in.photometry();
    PhotometricCalibration& out = lens.photometry;
    out.response.kind = static_cast<ResponseCurve::Kind>(p.response().kind());
    out.response.inverse.assign(p.response().inverse().begin(), p.response().inverse().end());
    if (out.response.kind == ResponseCurve::Kind::gamma) out.response.gamma = p.response().gamma();
    out.black_level = p.black_level();
    std::copy_n(p.vignetting().begin(), std::min(3, p.vignetting_size()), out.vignetting.begin());
    out.read_noise = p.read_noise();
    out.shot_noise = p.shot_noise();
    if (p.has_saturation()) out.saturation = p.saturation();
    std::copy_n(p.white_balance().begin(), std::min(3, p.white_balance_size()), out.white_balance.begin());
    rig.lenses.push_back(std::move(lens));
  }
  return rig;
}

v1::RigCalibration rig_to(const RigParameters& rig) {
  v1::RigCalibration m;
  m.set_nits_per_unit(rig.nits_per_unit);
  if (rig.report) fill_report(*rig.report, *m.mutable_report());
  for (const LensParameters& lens : rig.lenses) {
    v1::LensCalibration& out = *m.add_lens();
    out.set_width(static_cast<std::uint32_t>(lens.width));
    out.set_height(static_cast<std::uint32_t>(lens.height));
    if (const auto* p = std::get_if<KannalaBrandtParameters>(&lens.model))
      fill_model(*p, *out.mutable_kannala_brandt());
    else if (const auto* d = std::get_if<DoubleSphereParameters>(&lens.model))
      fill_model(*d, *out.mutable_double_sphere());
    else if (const auto* o = std::get_if<MeiParameters>(&lens.model))
      fill_model(*o, *out.mutable_mei());
    else
      out.mutable_equirectangular();
    out.set_max_angle_deg(lens.max_angle_rad / kDegree);
    fill_pose(lens.pose_cv, *out.mutable_pose());
    const PhotometricCalibration& p = lens.photometry;
    v1::Photometry& photometry = *out.mutable_photometry();
    v1::Response& response = *photometry.mutable_response();
    response.set_kind(static_cast<v1::Response::Kind>(p.response.kind));
    for (const double v : p.response.inverse) response.add_inverse(v);
    response.set_gamma(p.response.gamma);
    photometry.set_black_level(p.black_level);
    for (const double v : p.vignetting) photometry.add_vignetting(v);
    photometry.set_read_noise(p.read_noise);
    photometry.set_shot_noise(p.shot_noise);
    photometry.set_saturation(p.saturation);
    for (const double v : p.white_balance) photometry.add_white_balance(v);
  }
  return m;
}

}  // namespace

Status RigParameters::validate() const {
  if (lenses.empty() || lenses.size() > 2)
    return invalid_argument("a rig has one or two lenses, this one has " + std::to_string(lenses.size()));
  if (!(nits_per_unit >= 0) || !std::isfinite(nits_per_unit))
    return invalid_argument("nits_per_unit must be 0 (not known) or positive");
  for (std::size_t i = 0; i < lenses.size(); ++i) {
    const LensParameters& lens = lenses[i];
    const auto bad = [i](const std::string& what) {
      return invalid_argument("lens " + std::to_string(i) + ": " + what);
    };
    if (lens.width < 1 || lens.height < 1 || lens.width > 16384 || lens.height > 16384)
      return bad("width and height must be 1 to 16384 pixels");
    if (!std::holds_alternative<EquirectangularParameters>(lens.model) &&
        !(lens.max_angle_rad > 0 && lens.max_angle_rad <= std::numbers::pi))
      return bad("max_angle_deg must be above 0 and at most 180 (half the field of view)");
    if (const Status s = model_problem(lens); !s.ok()) return bad(s.message());
    const Quat& q = lens.pose_cv.rotation;
    if (!(std::sqrt(q.x * q.x + q.y * q.y + q.z * q.z + q.w * q.w) > 1e-9)) return bad("pose has no rotation");
    if (const Status s = photometry_problem(lens.photometry, lens.max_angle_rad); !s.ok()) return bad(s.message());
  }
  return {};
}

Result<RigParameters> parse_calibration(std::string_view text, const std::string& name) {
  v1::RigCalibration m;
  if (const Status s = parse_text_message(text, name, m); !s.ok()) return s;
  for (int i = 0; i < m.lens_size(); ++i) {
    const auto bad = [&](const std::string& what) {
      return invalid_argument(name + ": lens " + std::to_string(i) + ": " + what);
    };
    if (m.lens(i).model_case() == v1::LensCalibration::MODEL_NOT_SET)
      return bad("no camera model; add kannala_brandt, double_sphere, mei or equirectangular");
    if (m.lens(i).photometry().vignetting_size() > 3) return bad("photometry.vignetting has more than 3 coefficients");
    if (const int n = m.lens(i).photometry().white_balance_size(); n != 0 && n != 3)
      return bad("photometry.white_balance needs r, g and b");
  }
  RigParameters rig = rig_from(m);
  if (const Status s = rig.validate(); !s.ok()) return s.in(name);
  return rig;
}

Result<RigParameters> load_calibration(const std::string& path) { return load_text(path, parse_calibration); }
std::string calibration_to_text(const RigParameters& rig) { return text_of(rig_to(rig)); }

// Equal values have equal bytes, because the message has no field of type map.
std::string encode_calibration(const RigParameters& rig) {
  v1::RigCalibration m = rig_to(rig);
  m.clear_report();
  return m.SerializeAsString();
}

CalibrationSummary summary_of(const RigParameters& rig, std::string file) {
  CalibrationSummary out{calibration_identity(rig), std::move(file), rig.nits_per_unit > 0, {}, rig.report};
  const v1::RigCalibration m = rig_to(rig);
  for (const v1::LensCalibration& lens : m.lens()) {
    const v1::Photometry& p = lens.photometry();
    const auto* model = lens.GetReflection()->GetOneofFieldDescriptor(lens, lens.GetDescriptor()->oneof_decl(0));
    const auto corrects = [](double v) { return v != 0; };
    out.lenses.push_back({lens.width(), lens.height(), model->name(), lens.max_angle_deg(),
                          std::string(response_name(p.response().kind())),
                          std::any_of(p.vignetting().begin(), p.vignetting().end(), corrects),
                          p.read_noise() > 0 || p.shot_noise() > 0});
  }
  return out;
}

Result<RigParameters> decode_calibration(std::string_view bytes) {
  v1::RigCalibration m;
  if (!m.ParseFromArray(bytes.data(), static_cast<int>(bytes.size())))
    return Status(StatusCode::data_loss, "not a RigCalibration");
  RigParameters rig = rig_from(m);
  if (const Status s = rig.validate(); !s.ok()) return s;
  return rig;
}

std::uint32_t calibration_identity(const RigParameters& rig) { return fnv1a_32(encode_calibration(rig)); }

Result<UncertainPose> parse_mounting(std::string_view text, const std::string& name) {
  v1::Mounting m;
  if (const Status s = parse_text_message(text, name, m); !s.ok()) return s;
  const Result<UncertainPose> out = mounting_from(m);
  return out ? out : out.status().in(name);
}

Result<UncertainPose> load_mounting(const std::string& path) { return load_text(path, parse_mounting); }
std::string mounting_to_text(const UncertainPose& T_world_probe) { return text_of(mounting_to(T_world_probe)); }

}  // namespace lightwell
