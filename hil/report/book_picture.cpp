#include "report/book_picture.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>

#include <lightwell/pixel.hpp>
#include <lightwell/text.hpp>

namespace lightwell::hil {
namespace {

constexpr int kMargin = 16, kText = 22, kWide = 408, kNarrow = 240, kDisc = 180;
constexpr int kWidth = 3 * kWide + 4 * kMargin;
constexpr int kDifference = 4;  ///< Factor of differences.

/// A frame of the camera, decoded.
LinearPicture frame_of(const measure::SpecularSequence& sequence, int k) {
  const measure::Shot shot = sequence.frame(k);
  LinearPicture out(sequence.options().width, sequence.options().height);
  const auto value = [&](std::size_t i) {
    return static_cast<float>(srgb_to_linear(std::to_integer<int>(shot.pixels[0][i]) / 255.0) / kFullScale);
  };
  for (std::size_t at = 0; at < out.pixels.size(); ++at) {
    out.pixels[at] = {value(3 * at), value(3 * at + 1), value(3 * at + 2)};
    out.alpha[at] = 1;
  }
  return out;
}

/// A disc of directions towards the viewer, stereographic: the normal in the middle, +Y at the top.
template <class RadianceOf>
LinearPicture disc(const RadianceOf& radiance) {
  LinearPicture out(kDisc, kDisc);
  for (int j = 0; j < kDisc; ++j)
    for (int i = 0; i < kDisc; ++i) {
      const DiscPoint p{(2 * i + 1.0) / kDisc - 1, 1 - (2 * j + 1.0) / kDisc};
      const double edge = (1 - std::hypot(p.x, p.y)) * kDisc / 2 + 0.5;
      if (edge <= 0) continue;
      out.alpha[out.at(i, j)] = static_cast<float>(std::min(1.0, edge));
      out.pixels[out.at(i, j)] = radiance(from_stereographic(p));
    }
  return out;
}

constexpr Radiance kSeen{0.1F, 0.55F, 0.12F}, kUnseen{0.25F, 0.25F, 0.25F}, kNow{0.8F, 0.02F, 0.02F};

LinearPicture coverage_disc(const PlaneAppearance& plane) {
  const std::optional<Vec3d> now = probe_direction(plane.info());
  const PlaneCoverage& coverage = plane.coverage();
  const double circle = guidance_disc_radius();
  return disc([&](Vec3d d) {
    const DiscPoint p = stereographic(d);
    if (std::abs(std::hypot(p.x, p.y) - circle) < 1.0 / kDisc) return Radiance{};
    if (now && angle_between(d, *now) < 0.06) return kNow;
    return coverage.seen[coverage.grid.nearest(vec_cast<float>(d))] != 0 ? kSeen : kUnseen;
  });
}

/// kDifference (drawn - real) in codes of sRGB about mid-grey, where the SDK drew.
LinearPicture difference(const LinearPicture& real, const LinearPicture& drawn) {
  LinearPicture out(real.width, real.height);
  const auto code = [](float v) { return linear_to_srgb(std::clamp(static_cast<double>(v) * kFullScale, 0.0, 1.0)); };
  const auto shown = [&](float a, float b) {
    return static_cast<float>(srgb_to_linear(std::clamp(0.5 + kDifference * (code(b) - code(a)), 0.0, 1.0)) /
                              kFullScale);
  };
  for (std::size_t at = 0; at < out.pixels.size(); ++at) {
    if (drawn.alpha[at] < 1) continue;
    const Radiance &a = real.pixels[at], &b = drawn.pixels[at];
    out.pixels[at] = {shown(a.r, b.r), shown(a.g, b.g), shown(a.b, b.b)};
    out.alpha[at] = 1;
  }
  return out;
}

/// The part of a view around the plane, with the view's proportions and some space for what stands on it.
struct Part {
  int x = 0, y = 0, width = 0, height = 0;

  [[nodiscard]] LinearPicture of(const LinearPicture& view) const { return cut_out(view, x, y, width, height); }
};
Part part_around(const LinearPicture& drawn) {
  int left = drawn.width, right = 0, top = drawn.height, bottom = 0;
  for (int j = 0; j < drawn.height; ++j)
    for (int i = 0; i < drawn.width; ++i)
      if (drawn.alpha[drawn.at(i, j)] > 0) {
        left = std::min(left, i), right = std::max(right, i);
        top = std::min(top, j), bottom = std::max(bottom, j);
      }
  if (left > right) return {0, 0, drawn.width, drawn.height};
  const double scale = std::min(
      1.0, 1.1 * std::max(static_cast<double>(right - left) / drawn.width, 1.15 * (bottom - top) / drawn.height));
  const int width = static_cast<int>(scale * drawn.width), height = static_cast<int>(scale * drawn.height);
  return {std::clamp((left + right - width) / 2, 0, drawn.width - width),
          std::clamp((top + bottom - height) / 2 - height / 20, 0, drawn.height - height), width, height};
}

/// Rings around the lights, in a map of the upper hemisphere.
void mark_lights(Page& page, int x, int y, const Lighting& light) {
  int number = 0;
  for (const Light& l : light.lights()) {
    ++number;
    const reference::V3 d = reference::world_from_plane(
        {static_cast<double>(l.direction.x), static_cast<double>(l.direction.y), static_cast<double>(l.direction.z)});
    const reference::V2 at = reference::direction_to_pixel(d, kWide, kWide / 2);
    if (at.y < kWide / 4.0) page.ring(x + static_cast<int>(at.x), y + static_cast<int>(at.y), 5, number);
  }
}

}  // namespace

Status draw_book_report(const std::string& path, const measure::SpecularSequence& sequence,
                        const PlaneAppearance& plane, const Lighting& light, const BookEvaluation& evaluation) {
  const measure::SpecularSequenceOptions& options = sequence.options();
  const BookNumbers& n = evaluation.numbers;
  const BookPictures& p = evaluation.pictures;
  const int high = kWide * options.height / options.width, narrow_high = kNarrow * options.height / options.width;
  const int row_a = kMargin + kText, row_b = row_a + kText + std::max(kDisc, narrow_high) + kMargin;
  const int row_c = row_b + kText + high + kMargin, row_d = row_c + kText + high + kMargin;
  Page page(kWidth, row_d + kText + kDisc + kMargin);
  page.write(
      "A glossy book in front of a hand-held camera: lightwelld --estimator specular, and what the SDK makes of it",
      kMargin, kMargin + kText / 2, 0.6);

  const auto caption = [&](const std::string& text, int x, int row) { page.write(text, x, row + kText - 7, 0.45); };
  const auto narrow = [](int k) { return kMargin + k * (kNarrow + kMargin); };
  const auto wide = [](int k) { return kMargin + k * (kWide + kMargin); };
  int column = 0;
  for (const int k : {options.frames / 5, options.frames - options.frames / 12 - 1}) {
    caption(formatted("camera, frame %d", k), narrow(column), row_a);
    page.paste(frame_of(sequence, k), narrow(column++), row_a + kText, kFullScale, kNarrow);
  }
  const auto draw_disc = [&](const std::string& text, const LinearPicture& picture, double exposure) {
    caption(text, narrow(column), row_a);
    page.paste(picture, narrow(column++) + (kNarrow - kDisc) / 2, row_a + kText, exposure);
  };
  draw_disc("seen from (green), now (red)", coverage_disc(plane), 1);
  const auto true_gloss = [&](Vec3d d) {
    const reference::Rgb s = sequence.scene().specular->radiance({d.x, d.y, d.z});
    return Radiance{static_cast<float>(s[0] / kFullScale), static_cast<float>(s[1] / kFullScale),
                    static_cast<float>(s[2] / kFullScale)};
  };
  const double gloss_exposure = exposure_for(disc(true_gloss));
  const auto where_seen = [&](Vec3d d, const Radiance& gloss) {
    return plane.specular(d).flags.has(PlaneFlag::unseen_direction) ? kUnseen * static_cast<float>(1 / gloss_exposure)
                                                                    : gloss;
  };
  draw_disc("its gloss by direction, captured", disc([&](Vec3d d) { return where_seen(d, plane.specular(d).value); }),
            gloss_exposure);
  draw_disc("its gloss by direction, true", disc([&](Vec3d d) { return where_seen(d, true_gloss(d)); }),
            gloss_exposure);

  const Part part = part_around(p.drawn);
  caption("a view that is not among the frames", wide(0), row_b);
  page.paste(part.of(p.real), wide(0), row_b + kText, kFullScale, kWide);
  caption(formatted("the same view drawn by the SDK: RMSE %.3f", n.rmse_shown), wide(1), row_b);
  page.paste(part.of(p.drawn), wide(1), row_b + kText, kFullScale, kWide);
  caption(formatted("their difference, %d times (grey: none)", kDifference), wide(2), row_b);
  page.paste(part.of(difference(p.real, p.drawn)), wide(2), row_b + kText, kFullScale, kWide);

  const double exposure = exposure_for(p.true_light);
  caption("light above the book: found, with its lights", wide(0), row_c);
  page.paste(p.light, wide(0), row_c + kText, exposure);
  mark_lights(page, wide(0), row_c + kText, light);
  const int lower = row_c + kText + kWide / 4 + kMargin;
  caption("true, blurred by the same lobe", wide(0), lower);
  page.paste(p.true_light, wide(0), lower + kText, exposure);
  mark_lights(page, wide(0), lower + kText, light);
  caption("virtual balls in the real view: the SDK's light", wide(1), row_c);
  page.paste(part.of(p.balls), wide(1), row_c + kText, kFullScale, kWide);
  caption("the same with the true light", wide(2), row_c);
  page.paste(part.of(p.true_balls), wide(2), row_c + kText, kFullScale, kWide);

  caption("their shadow alone: the SDK's", narrow(0), row_d);
  page.paste(p.shadow, narrow(0), row_d + kText, 1, kDisc);
  caption("the true one", narrow(1), row_d);
  page.paste(p.true_shadow, narrow(1), row_d + kText, 1, kDisc);
  int line = row_d + kText;
  for (const std::string& text :
       {formatted("%d frames of %dx%d; %.0f %% of the directions above 10 deg (black circle) were seen", options.frames,
                  options.width, options.height, 100 * n.seen),
        formatted("views that are not among the frames: RMSE %.3f of full scale", n.rmse),
        formatted("roughness (alpha) of the gloss: %.3f, true %.3f", n.alpha, options.alpha),
        formatted("irradiance: error %.1f %%, the descriptor's bound %.0f %%", 100 * n.irradiance_error,
                  100 * n.irradiance_bound),
        formatted("strongest light: %.1f deg off; shadow: off by %.3f (RMS), 1 is all light", n.strongest_light_deg,
                  n.shadow_rms)}) {
    page.write(text, narrow(2), line += 28);
  }
  return page.save(path);
}

}  // namespace lightwell::hil
