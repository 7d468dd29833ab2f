#include "estimate/marker/light_fit.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include <Eigen/Cholesky>
#include <Eigen/QR>
#include <ceres/ceres.h>

#include "estimate/marker/light_priors.hpp"

namespace lightwell::marker {
namespace {

/// Steps of the numerical derivatives of the shadow: 0.1 degrees, and 1 cm for a light at 1 m.
constexpr double kDirectionStep_rad = 0.002, kInverseDistanceStep = 0.01;
/// Start of the constant ambient irradiance, as a share of the mean irradiance.
constexpr double kInitialAmbientFraction = 0.3;
/// Smallest distance of a light from the body's centre: 0.12 m, well outside of the body.
constexpr double kMaxInverseDistance = 1 / 0.12;

/// Residuals of standard deviation 1 and their derivatives: of faces by channel, of priors, of the ground plane.
class LightingCostFunction final : public ceres::CostFunction {
 public:
  LightingCostFunction(const Observations& observations, const FitLayout& layout, std::vector<LightPose> light_poses,
                       const std::vector<Vec3d>& hull)
      : observations_(observations),
        layout_(layout),
        light_poses_(std::move(light_poses)),
        hull_(hull),
        priors_(observations_, layout_, light_poses_) {
    const int ground_samples = layout.ground >= 0 ? static_cast<int>(observations.ground()->size()) : 0;
    set_num_residuals(observations.samples() * observations.channels() + priors_.rows() + ground_samples);
    mutable_parameter_block_sizes()->push_back(layout.size);
  }

  bool Evaluate(double const* const* parameters, double* residuals, double** jacobians) const override {
    const double* p = parameters[0];
    double* j = jacobians != nullptr ? jacobians[0] : nullptr;
    Eigen::Map<Eigen::VectorXd> r(residuals, num_residuals());
    Eigen::Map<RowMajor> jacobian(j, j != nullptr ? num_residuals() : 0, j != nullptr ? layout_.size : 0);
    if (j != nullptr) jacobian.setZero();
    evaluate_faces(p, r, j != nullptr ? &jacobian : nullptr);
    const Eigen::Index first = observations_.samples() * observations_.channels(), rows = priors_.rows();
    Eigen::Ref<RowMajor> of_priors = jacobian.middleRows(j != nullptr ? first : 0, j != nullptr ? rows : 0);
    priors_.evaluate(p, r.segment(first, rows), j != nullptr ? &of_priors : nullptr);
    if (layout_.ground >= 0) evaluate_ground(p, r, j != nullptr ? &jacobian : nullptr);
    return r.allFinite();
  }

  /// Residuals and Jacobian at `p`.
  [[nodiscard]] std::pair<Eigen::VectorXd, RowMajor> linearize(const Eigen::VectorXd& p) const {
    std::pair<Eigen::VectorXd, RowMajor> out(num_residuals(), RowMajor(num_residuals(), layout_.size));
    const double* parameters[1] = {p.data()};
    double* jacobians[1] = {out.second.data()};
    (void)Evaluate(parameters, out.first.data(), jacobians);
    return out;
  }

  [[nodiscard]] LightPose pose_at(const double* p, std::size_t light) const {
    const FitLayout::LightParameters& offsets = layout_.lights[light];
    LightPose out;
    out.direction = light_poses_[light].turned(p[offsets.turn], p[offsets.turn + 1]);
    const auto [u, v] = tangent_basis(out.direction);
    out.u = u;
    out.v = v;
    out.inverse_distance = offsets.inverse >= 0 ? p[offsets.inverse] : light_poses_[light].inverse_distance;
    return out;
  }

 private:
  template <class Jacobian>
  void evaluate_faces(const double* p, Eigen::Map<Eigen::VectorXd>& r, Jacobian* j) const {
    const std::vector<SurfaceSample>& samples = observations_.face_samples();
    const int n = observations_.samples();
    const std::size_t lights = layout_.lights.size();
    // Of each light: relative irradiance, and its derivatives by u, v and the inverse distance.
    Eigen::MatrixXd factors(n, static_cast<Eigen::Index>(4 * lights));
    for (std::size_t k = 0; k < lights; ++k) {
      const FitLayout::LightParameters& offsets = layout_.lights[k];
      const double du = p[offsets.turn], dv = p[offsets.turn + 1];
      const auto [d, to_u, to_v] = light_poses_[k].turned_with_slopes(du, dv);
      const double w = offsets.inverse >= 0 ? p[offsets.inverse] : light_poses_[k].inverse_distance;
      for (int i = 0; i < n; ++i) {
        const SurfaceSample& s = samples[static_cast<std::size_t>(i)];
        const Vec3d q = d - s.position * w;
        const double squared = dot(q, q), cosine = dot(s.normal, q);
        const auto column = static_cast<Eigen::Index>(4 * k);
        if (cosine <= 0) {
          factors.row(i).segment<4>(column).setZero();
          continue;
        }
        const double inverse_cube = 1 / (squared * std::sqrt(squared));
        const auto slope = [&](Vec3d dq) {
          return (dot(s.normal, dq) - 3 * cosine * dot(q, dq) / squared) * inverse_cube;
        };
        factors(i, column) = cosine * inverse_cube;
        factors(i, column + 1) = slope(to_u);
        factors(i, column + 2) = slope(to_v);
        factors(i, column + 3) = slope(-s.position);
        if (s.occluder_radius > 0) multiply_by_visibility(s, k, du, dv, w, factors.row(i).segment<4>(column));
      }
    }
    Eigen::VectorXd column(n);
    int row = 0;
    for (int c = 0; c < observations_.channels(); ++c, row += n) {
      const double* ambient = p + layout_.ambient + 4 * c;
      for (int i = 0; i < n; ++i) {
        const Vec3d& normal = samples[static_cast<std::size_t>(i)].normal;
        double sum = ambient[0] + ambient[1] * normal.x + ambient[2] * normal.y + ambient[3] * normal.z;
        for (std::size_t k = 0; k < lights; ++k)
          sum += p[layout_.lights[k].irradiance + c] * factors(i, static_cast<Eigen::Index>(4 * k));
        column[i] = sum;
      }
      observations_.whiten(c, column);
      r.segment(row, n) = column - observations_.whitened(c);
      if (j == nullptr) continue;
      const auto put = [&](int parameter, double scale, Eigen::Index from) {
        column = scale * factors.col(from);
        observations_.whiten(c, column);
        j->col(parameter).segment(row, n) = column;
      };
      for (std::size_t k = 0; k < lights; ++k) {
        const FitLayout::LightParameters& offsets = layout_.lights[k];
        const double irradiance = p[offsets.irradiance + c];
        const auto first = static_cast<Eigen::Index>(4 * k);
        put(offsets.turn, irradiance, first + 1);
        put(offsets.turn + 1, irradiance, first + 2);
        if (offsets.inverse >= 0) put(offsets.inverse, irradiance, first + 3);
        put(offsets.irradiance + c, 1, first);
      }
      for (int b = 0; b < 4; ++b) {
        for (int i = 0; i < n; ++i) {
          const Vec3d& normal = samples[static_cast<std::size_t>(i)].normal;
          column[i] = b == 0 ? 1 : b == 1 ? normal.x : b == 2 ? normal.y : normal.z;
        }
        observations_.whiten(c, column);
        j->col(layout_.ambient + 4 * c + b).segment(row, n) = column;
      }
    }
  }

  /// Of one sample and one light: `factors` is its relative irradiance without the sphere's shadow and the derivatives
  /// of that. The derivatives of the visibility are numerical.
  void multiply_by_visibility(const SurfaceSample& sample, std::size_t light, double du, double dv, double w,
                              Eigen::Ref<Eigen::RowVector4d, 0, Eigen::InnerStride<>> factors) const {
    const auto visibility = [&](double u, double v, double inverse) {
      return sphere_visibility(light_poses_[light].turned(u, v), inverse, sample);
    };
    const double a = kDirectionStep_rad, b = kInverseDistanceStep, visible = visibility(du, dv, w);
    const std::array slopes = {(visibility(du + a, dv, w) - visibility(du - a, dv, w)) / (2 * a),
                               (visibility(du, dv + a, w) - visibility(du, dv - a, w)) / (2 * a),
                               (visibility(du, dv, w + b) - visibility(du, dv, w - b)) / (2 * b)};
    for (int i = 0; i < 3; ++i)
      factors[i + 1] = factors[i + 1] * visible + factors[0] * slopes[static_cast<std::size_t>(i)];
    factors[0] *= visible;
  }

  template <class Jacobian>
  void evaluate_ground(const double* p, Eigen::Map<Eigen::VectorXd>& r, Jacobian* j) const {
    const GroundObservations& ground = *observations_.ground();
    const Eigen::Index n = ground.size(), row = num_residuals() - n;
    const double ambient = p[layout_.ground];
    sum_ = ambient * ground.open - ground.radiance;
    const auto put = [&](int parameter, const Eigen::ArrayXd& derivative) {
      j->col(parameter).segment(row, n) = ground.whitened(derivative);
    };
    if (j != nullptr) put(layout_.ground, ground.open);
    for (std::size_t k = 0; k < layout_.lights.size(); ++k) {
      const FitLayout::LightParameters& offsets = layout_.lights[k];
      const int own = layout_.ground + 1 + static_cast<int>(k);
      const LightPose pose = pose_at(p, k);
      shadow_.compute_irradiance(ground, hull_, pose.direction, pose.inverse_distance, unit_irradiance_);
      sum_ += p[own] * unit_irradiance_;
      if (j == nullptr) continue;
      put(own, unit_irradiance_);
      for (int axis = 0; axis < 2; ++axis) {
        for (const double sign : {1.0, -1.0}) {
          const double du = p[offsets.turn] + (axis == 0 ? sign * kDirectionStep_rad : 0);
          const double dv = p[offsets.turn + 1] + (axis == 1 ? sign * kDirectionStep_rad : 0);
          shadow_.compute_irradiance(ground, hull_, light_poses_[k].turned(du, dv), pose.inverse_distance,
                                     sign > 0 ? forward_ : backward_);
        }
        put(offsets.turn + axis, (forward_ - backward_) * (p[own] / (2 * kDirectionStep_rad)));
      }
      if (offsets.inverse < 0) continue;
      shadow_.compute_irradiance(ground, hull_, pose.direction, pose.inverse_distance + kInverseDistanceStep, forward_);
      shadow_.compute_irradiance(ground, hull_, pose.direction, pose.inverse_distance - kInverseDistanceStep,
                                 backward_);
      put(offsets.inverse, (forward_ - backward_) * (p[own] / (2 * kInverseDistanceStep)));
    }
    r.segment(row, n) = ground.whitened(sum_);
  }

  const Observations& observations_;
  const FitLayout& layout_;
  std::vector<LightPose> light_poses_;
  const std::vector<Vec3d>& hull_;
  LightPriors priors_;
  // Buffers. Ceres evaluates through a const pointer, here in one thread.
  mutable Shadow shadow_;
  mutable Eigen::ArrayXd sum_, unit_irradiance_, forward_, backward_;
};

LightPose light_pose_of(const PointLight& light) {
  const auto [u, v] = tangent_basis(light.direction);
  return {light.direction, u, v, light.inverse_distance};
}

/// Solves for the linear parameters, zero in `p`, by least squares. The caller clamps negative values.
void solve_linear(const LightingCostFunction& cost_function, const FitLayout& layout, const Observations& observations,
                  Eigen::VectorXd& p) {
  for (int c = 0; c < observations.channels(); ++c)
    p[layout.ambient + 4 * c] = kInitialAmbientFraction * observations.mean_irradiance(c);
  const auto [r, j] = cost_function.linearize(p);
  std::vector<int> linear;
  for (const FitLayout::LightParameters& offsets : layout.lights)
    for (int c = 0; c < observations.channels(); ++c) linear.push_back(offsets.irradiance + c);
  for (int i = layout.ambient; i < layout.size; ++i) linear.push_back(i);
  Eigen::MatrixXd part(j.rows(), static_cast<Eigen::Index>(linear.size()));
  for (std::size_t i = 0; i < linear.size(); ++i) part.col(static_cast<Eigen::Index>(i)) = j.col(linear[i]);
  const Eigen::MatrixXd normal = part.transpose() * part;
  // Tikhonov regularization of 1e-9: a light that illuminates nothing has a zero column.
  const double ridge = 1e-9 * std::max(normal.diagonal().maxCoeff(), 1e-300);
  const Eigen::VectorXd x =
      (normal + ridge * Eigen::MatrixXd::Identity(normal.rows(), normal.cols())).ldlt().solve(-part.transpose() * r);
  for (std::size_t i = 0; i < linear.size(); ++i) p[linear[i]] += x[static_cast<Eigen::Index>(i)];
}

/// Indices of the parameters that must not be negative: irradiances, constant ambient terms, ground radiances.
std::vector<int> nonnegative_parameters(const FitLayout& layout, int channels) {
  std::vector<int> out;
  for (const FitLayout::LightParameters& offsets : layout.lights)
    for (int c = 0; c < channels; ++c) out.push_back(offsets.irradiance + c);
  for (int c = 0; c < channels; ++c) out.push_back(layout.ambient + 4 * c);
  if (layout.ground >= 0)
    for (int i = layout.ground; i < layout.size; ++i) out.push_back(i);
  return out;
}

}  // namespace

Fit fit_lights(const Observations& observations, std::vector<PointLight> lights, std::vector<Distance> distances,
               ObservationSet observation_set, const std::vector<Vec3d>& hull, int max_iterations) {
  const int channels = observations.channels();
  const bool with_ground =
      observation_set == ObservationSet::faces_and_ground_plane && observations.ground() != nullptr;
  const FitLayout layout(distances, channels, with_ground);
  std::vector<LightPose> light_poses;
  for (const PointLight& light : lights) light_poses.push_back(light_pose_of(light));

  Eigen::VectorXd p = Eigen::VectorXd::Zero(layout.size);
  for (std::size_t k = 0; k < lights.size(); ++k)
    if (layout.lights[k].inverse >= 0)
      p[layout.lights[k].inverse] = std::clamp(lights[k].inverse_distance, 0.0, kMaxInverseDistance);
  auto* cost_function = new LightingCostFunction(observations, layout, light_poses, hull);
  solve_linear(*cost_function, layout, observations, p);
  const std::vector<int> nonnegative = nonnegative_parameters(layout, channels);
  for (const int i : nonnegative) p[i] = std::max(p[i], 0.0);

  ceres::Problem problem;
  problem.AddResidualBlock(cost_function, nullptr, p.data());
  for (const int i : nonnegative) problem.SetParameterLowerBound(p.data(), i, 0);
  for (const FitLayout::LightParameters& offsets : layout.lights) {
    // Limits the rotation to the hemisphere around the start, on which the parametrization is valid.
    for (int axis = 0; axis < 2; ++axis) {
      problem.SetParameterLowerBound(p.data(), offsets.turn + axis, -1.5);
      problem.SetParameterUpperBound(p.data(), offsets.turn + axis, 1.5);
    }
    if (offsets.inverse < 0) continue;
    problem.SetParameterLowerBound(p.data(), offsets.inverse, 0);
    problem.SetParameterUpperBound(p.data(), offsets.inverse, kMaxInverseDistance);
  }
  ceres::Solver::Options solver_options;
  // QR, because a light that illuminates nothing leaves a zero column.
  solver_options.linear_solver_type = ceres::DENSE_QR;
  solver_options.max_num_iterations = max_iterations;
  solver_options.function_tolerance = 1e-7;
  solver_options.logging_type = ceres::SILENT;
  solver_options.num_threads = 1;
  ceres::Solver::Summary summary;
  ceres::Solve(solver_options, &problem, &summary);

  Fit out;
  out.distances = std::move(distances);
  out.ground = with_ground;
  out.parameters = layout.size;
  out.channels = channels;
  out.face_samples = observations.samples();
  out.observations = observations.samples() * channels;
  if (with_ground) {
    out.observations += static_cast<int>(observations.ground()->size());
    out.ground_samples = static_cast<double>(observations.ground()->size()) / observations.ground()->density;
  }
  std::vector<LightPose> found;
  for (std::size_t k = 0; k < lights.size(); ++k) {
    found.push_back(cost_function->pose_at(p.data(), k));
    PointLight light{found[k].direction, found[k].inverse_distance, {}};
    for (int c = 0; c < 3; ++c)
      light.irradiance[static_cast<std::size_t>(c)] = p[layout.lights[k].irradiance + std::min(c, channels - 1)];
    out.model.lights.push_back(light);
    if (with_ground) out.ground_irradiance.push_back(p[layout.ground + 1 + static_cast<int>(k)]);
  }
  for (int b = 0; b < 4; ++b)
    for (int c = 0; c < 3; ++c)
      out.model.ambient[static_cast<std::size_t>(b)][static_cast<std::size_t>(c)] =
          p[layout.ambient + 4 * std::min(c, channels - 1) + b];
  if (with_ground) out.ground_ambient = p[layout.ground];

  // Linearizes at the minimum, so that the covariance refers to its tangent plane.
  const LightingCostFunction at_minimum(observations, layout, found, hull);
  for (const FitLayout::LightParameters& offsets : layout.lights) p[offsets.turn] = p[offsets.turn + 1] = 0;
  const auto [r, j] = at_minimum.linearize(p);
  out.chi_square = r.squaredNorm();
  const Eigen::Index n = observations.samples();
  for (int c = 0; c < channels; ++c) out.face_chi_square += r.segment(c * n, n).squaredNorm();
  if (with_ground) {
    out.ground_chi_square = r.tail(observations.ground()->size()).squaredNorm();
    if (max_iterations == kMaxFitIterations)
      out.ground_deviance = observations.ground()->marginal_deviance(ground_residuals(observations, out, hull));
  }
  // Wide priors keep the covariance finite: standard deviations of 1 rad for directions and 10/m for inverse distances.
  Eigen::MatrixXd information = j.transpose() * j;
  for (const FitLayout::LightParameters& offsets : layout.lights) {
    information(offsets.turn, offsets.turn) += 1;
    information(offsets.turn + 1, offsets.turn + 1) += 1;
    if (offsets.inverse >= 0) information(offsets.inverse, offsets.inverse) += 0.01;
  }
  for (int i = 0; i < layout.size; ++i)
    information(i, i) += 1e-12 * std::max(information.diagonal().maxCoeff(), 1e-300);
  const Eigen::MatrixXd covariance = information.ldlt().solve(Eigen::MatrixXd::Identity(layout.size, layout.size));
  const double variance_scale = out.dispersion();
  for (std::size_t k = 0; k < lights.size(); ++k) {
    const FitLayout::LightParameters& offsets = layout.lights[k];
    const std::array<int, 3> index = {offsets.turn, offsets.turn + 1, offsets.inverse};
    Eigen::Matrix3d block = Eigen::Matrix3d::Zero();
    for (int a = 0; a < 3; ++a)
      for (int b = 0; b < 3; ++b)
        if (index[static_cast<std::size_t>(a)] >= 0 && index[static_cast<std::size_t>(b)] >= 0)
          block(a, b) =
              variance_scale * covariance(index[static_cast<std::size_t>(a)], index[static_cast<std::size_t>(b)]);
    out.covariance.push_back(block);
  }
  return out;
}

}  // namespace lightwell::marker
