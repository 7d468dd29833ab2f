#include <map>
#include <utility>

#include "bench/straughn2018_tags.hpp"
#include "measure/marker_methods.hpp"

namespace lightwell::measure {

namespace {

using bench::StraughnCase;
using bench::StraughnOptions;

class StraughnMethod final : public MarkerMethod {
 public:
  StraughnMethod(bench::StraughnEncoding encoding, bench::StraughnTagDetector detector)
      : encoding_(encoding), detector_(std::move(detector)) {}

  Status process(const TracedFrame& frame, const RigParameters& rig, const MarkerBody& body,
                 const Shot& shot) override {
    const LensParameters& lens = rig.lenses.front();
    const auto& pinhole = std::get<MeiParameters>(lens.model);
    const bench::StraughnCamera camera{lens.width, lens.height, pinhole.fx, pinhole.fy, pinhole.cx, pinhole.cy};
    const View& view = shot.frames.front().views().front();
    const auto* bytes = reinterpret_cast<const std::uint8_t*>(view.data.data());
    const bench::StraughnPicture picture{view.width, view.height, 3, {bytes, view.data.size()}, view.stride};
    const auto tags = detector_.detect(picture);
    if (!tags) return tags.status();
    // References to elements of a map stay valid.
    auto marker = markers_.find(body.name);
    if (marker == markers_.end()) marker = markers_.emplace(body.name, bench::straughn_marker(body, encoding_)).first;
    for (std::vector<StraughnCase>* cases : {&plain_, &letter_}) {
      StraughnOptions options;
      options.normals = cases == &plain_ ? StraughnOptions::Normals::pose : StraughnOptions::Normals::letter;
      cases->push_back({&marker->second, bench::straughn_sample(picture, camera, marker->second, *tags, options),
                        frame.lamps.front().direction});
    }
    in_grid_.push_back(frame.group == "grid");
    return {};
  }

  std::vector<MarkerColumn> columns() const override {
    const auto of_grid = [&](const std::vector<StraughnCase>& cases) {
      std::vector<StraughnCase> chosen;
      for (std::size_t k = 0; k < cases.size(); ++k)
        if (in_grid_[k]) chosen.push_back(cases[k]);
      const auto best = bench::straughn_best_threshold(chosen);
      return best ? best->threshold : StraughnOptions{}.threshold;
    };
    MarkerColumn each{"seed_each", {}, 0};
    for (const StraughnCase& one : plain_) {
      const auto best = bench::straughn_best_threshold({&one, 1});
      each.answers.push_back(answer(one, best ? best->threshold : StraughnOptions{}.threshold));
    }
    return {column("seed", plain_, of_grid(plain_)), column("seed_letter", letter_, of_grid(letter_)),
            column("seed_half", plain_, StraughnOptions{}.threshold), each};
  }

 private:
  static MarkerAnswer answer(const StraughnCase& one, double threshold) {
    StraughnOptions options;
    options.threshold = threshold;
    const bench::StraughnLight light = bench::straughn_light(*one.marker, one.seen, options);
    return {light.known, false, light.direction};
  }
  static MarkerColumn column(const char* name, const std::vector<StraughnCase>& cases, double threshold) {
    MarkerColumn out{name, {}, threshold};
    for (const StraughnCase& one : cases) out.answers.push_back(answer(one, threshold));
    return out;
  }

  bench::StraughnEncoding encoding_;
  bench::StraughnTagDetector detector_;
  std::map<std::string, bench::StraughnMarker> markers_;
  std::vector<StraughnCase> plain_, letter_;
  std::vector<bool> in_grid_;
};

}  // namespace

Result<std::unique_ptr<MarkerMethod>> make_straughn_method(bool srgb) {
  const auto encoding = srgb ? bench::StraughnEncoding::srgb : bench::StraughnEncoding::linear;
  auto detector = bench::StraughnTagDetector::make({.encoding = encoding, .thresholds = {}});
  if (!detector) return detector.status();
  return std::unique_ptr<MarkerMethod>(std::make_unique<StraughnMethod>(encoding, std::move(*detector)));
}

}  // namespace lightwell::measure
