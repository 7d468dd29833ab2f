// The shipped marker bodies, and a pinhole camera to see them with.
#pragma once

#include <string>

#include <gtest/gtest.h>

#include <lightwell/calibration.hpp>
#include <lightwell/marker_body.hpp>

#include "calibration/model/camera_model.hpp"

namespace lightwell::test {

/// `name`: of the file, without extension.
inline MarkerBody shipped_body(const std::string& name) {
  Result<MarkerBody> body = load_marker_body(std::string(LIGHTWELL_MARKER_BODIES) + "/" + name + ".textproto");
  EXPECT_TRUE(body) << body.status().message();
  return body ? std::move(*body) : MarkerBody{};
}

/// 640x480, 800 px; the lens is at the probe, upright.
inline LensParameters pinhole() {
  LensParameters lens;
  lens.width = 640;
  lens.height = 480;
  MeiParameters model;
  model.fx = model.fy = 800;
  model.cx = 319.5;
  model.cy = 239.5;
  lens.model = model;
  lens.max_angle_rad = 1.2;
  lens.pose_cv = {upright_lens_cv(), {}};
  return lens;
}

}  // namespace lightwell::test
