#include <map>
#include <utility>

#include "bench/s1_tags.hpp"
#include "measure/marker_methods.hpp"

namespace lightwell::measure {

namespace {

using bench::S1Case;
using bench::S1Options;

class SeedMethod final : public MarkerMethod {
 public:
  SeedMethod(bench::S1Encoding encoding, bench::S1TagDetector detector)
      : encoding_(encoding), detector_(std::move(detector)) {}

  Status look(const TracedFrame& frame, const RigParameters& rig, const MarkerBody& body, const Shot& shot) override {
    const LensParameters& lens = rig.lenses.front();
    const auto& pinhole = std::get<MeiParameters>(lens.model);
    const bench::S1Camera camera{lens.width, lens.height, pinhole.fx, pinhole.fy, pinhole.cx, pinhole.cy};
    const View& view = shot.frames.front().views().front();
    const auto* bytes = reinterpret_cast<const std::uint8_t*>(view.data.data());
    const bench::S1Picture picture{view.width, view.height, 3, {bytes, view.data.size()}, view.stride};
    const auto tags = detector_.detect(picture);
    if (!tags) return tags.status();
    // References of a map stay where they are.
    auto marker = markers_.find(body.name);
    if (marker == markers_.end()) marker = markers_.emplace(body.name, bench::s1_marker(body, encoding_)).first;
    for (std::vector<S1Case>* cases : {&plain_, &letter_}) {
      S1Options options;
      options.normals = cases == &plain_ ? S1Options::Normals::pose : S1Options::Normals::letter;
      cases->push_back({&marker->second, bench::s1_sample(picture, camera, marker->second, *tags, options),
                        frame.lamps.front().direction});
    }
    in_grid_.push_back(frame.group == "grid");
    return {};
  }

  std::vector<MarkerColumn> columns() const override {
    const auto of_grid = [&](const std::vector<S1Case>& cases) {
      std::vector<S1Case> chosen;
      for (std::size_t k = 0; k < cases.size(); ++k)
        if (in_grid_[k]) chosen.push_back(cases[k]);
      const auto best = bench::s1_best_threshold(chosen);
      return best ? best->threshold : S1Options{}.threshold;
    };
    MarkerColumn each{"seed_each", {}, 0};
    for (const S1Case& one : plain_) {
      const auto best = bench::s1_best_threshold({&one, 1});
      each.answers.push_back(answer(one, best ? best->threshold : S1Options{}.threshold));
    }
    return {column("seed", plain_, of_grid(plain_)), column("seed_letter", letter_, of_grid(letter_)),
            column("seed_half", plain_, S1Options{}.threshold), each};
  }

 private:
  static MarkerAnswer answer(const S1Case& one, double threshold) {
    S1Options options;
    options.threshold = threshold;
    const bench::S1Light light = bench::s1_light(*one.marker, one.seen, options);
    return {light.known, false, light.direction};
  }
  static MarkerColumn column(const char* name, const std::vector<S1Case>& cases, double threshold) {
    MarkerColumn out{name, {}, threshold};
    for (const S1Case& one : cases) out.answers.push_back(answer(one, threshold));
    return out;
  }

  bench::S1Encoding encoding_;
  bench::S1TagDetector detector_;
  std::map<std::string, bench::S1Marker> markers_;
  std::vector<S1Case> plain_, letter_;
  std::vector<bool> in_grid_;
};

}  // namespace

Result<std::unique_ptr<MarkerMethod>> make_seed_method(bool srgb) {
  const auto encoding = srgb ? bench::S1Encoding::srgb : bench::S1Encoding::linear;
  auto detector = bench::S1TagDetector::make({.encoding = encoding, .thresholds = {}});
  if (!detector) return detector.status();
  return std::unique_ptr<MarkerMethod>(std::make_unique<SeedMethod>(encoding, std::move(*detector)));
}

}  // namespace lightwell::measure
