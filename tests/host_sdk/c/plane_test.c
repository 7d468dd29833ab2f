/* Captured planes through the C ABI, on the golden message: a plane of 0.2 m with 12 x 12 texels, a lumisphere of 4
 * levels, coverage of 3 levels. Its radiance is linear: D = (0.5 + 2 x, 0.4 - 1.5 y, 0.3 + x + y), S = 0.1 + 0.5 theta
 * times (1, 0.5, 2) (tests/support/captured_planes.hpp); texture_to_plane is a similarity close to the identity. */
#include <math.h>
#include <string.h>

#include <lightwell/plane_appearance.h>

#include "check.h"

static unsigned char message[65536];
static size_t message_length;

static int near_to(double value, double truth, double tolerance) { return fabs(value - truth) <= tolerance; }

static lw_plane* received(void) {
  lw_plane_reader* reader = NULL;
  lw_plane* plane = NULL;
  CHECK(lw_plane_reader_create(&reader) == LW_OK && lw_plane_create(&plane) == LW_OK);
  CHECK(lw_plane_reader_snapshot(reader, 1, plane) == LW_OK);
  lw_plane_info info = {.size = sizeof info};
  CHECK(lw_plane_get_info(plane, &info) == LW_OK);
  CHECK(info.validity == LW_NONE && info.revision == 0 && info.f0 == -1);
  CHECK(lw_plane_reader_take(reader, message, message_length, 1000) == LW_OK);
  CHECK(lw_plane_reader_take(reader, message, message_length, 1000) == LW_OK);
  CHECK(lw_plane_reader_take(reader, message, message_length - 1, 1000) != LW_OK);
  CHECK(lw_plane_reader_take(reader, NULL, 3, 1000) == LW_INVALID_ARGUMENT);
  CHECK(lw_plane_reader_snapshot(reader, 3000, plane) == LW_OK);
  lw_plane_reader_stats stats = {.size = sizeof stats};
  CHECK(lw_plane_reader_get_stats(reader, &stats) == LW_OK);
  CHECK(stats.messages == 2 && stats.refused == 1 && stats.tiles == 3 && stats.tiles_unused == 3);
  lw_plane_reader_release(reader);
  return plane;
}

static void properties_are_those_of_the_message(const lw_plane* plane) {
  lw_plane_info info = {.size = sizeof info};
  CHECK(lw_plane_get_info(plane, &info) == LW_OK);
  CHECK(info.validity == LW_VALID && info.age_ns == 2000 && info.revision == 1 && info.missing_tiles == 0);
  CHECK(info.capture == 0xC0FFEE && info.texture_edge == 12 && info.mid_exposure_ns == 5000000000);
  CHECK(info.side == 0.2 && info.units == LW_RELATIVE && info.pose_known == 1);
  CHECK(info.position[0] == 0.01 && info.position[1] == 0.02 && info.position[2] == -0.5 && info.orientation[3] == 1);
  CHECK(info.texture_position[0] == 0.001 && info.texture_position[1] == 0.002);
  CHECK(info.texture_rotation == 0.003 && info.texture_scale == 1.004);
  CHECK(info.gloss_alpha == 0.125F && info.f0 == 0.0625F);
}

static void answers_are_the_radiance(const lw_plane* plane) {
  const double point[2] = {0.031, -0.022}, eye[3] = {0.031, -0.322, 0.3}, behind[3] = {0, 0, -1};
  const double towards[3] = {0, -3, 3}, outside[2] = {0.2, 0};
  /* In the texture: by the inverse of the similarity. */
  const double x = (0.030 * cos(0.003) - 0.024 * sin(0.003)) / 1.004;
  const double y = (-0.024 * cos(0.003) - 0.030 * sin(0.003)) / 1.004;
  const double d[3] = {0.5 + 2 * x, 0.4 - 1.5 * y, 0.3 + x + y};
  const double s = 0.1 + 0.5 * 0.78539816;
  const double specular[3] = {s, 0.5 * s, 2 * s};
  lw_plane_answer all = {.size = sizeof all}, diffuse = all, gloss = all, bad = all;
  CHECK(lw_plane_radiance(plane, point, eye, LW_PLANE_ALL, &all) == LW_OK);
  CHECK(lw_plane_diffuse(plane, point, &diffuse) == LW_OK);
  CHECK(lw_plane_specular(plane, towards, &gloss) == LW_OK);
  CHECK(all.validity == LW_VALID && all.units == LW_RELATIVE && all.flags == 0);
  for (int k = 0; k < 3; ++k) {
    /* Nine bits of the largest channel, which is below 1. */
    CHECK(near_to(diffuse.value[k], d[k], 0.002));
    CHECK(near_to(gloss.value[k], specular[k], 0.002));
    CHECK(near_to(all.value[k], d[k] + specular[k], 0.004));
  }
  bad.value[0] = 9;
  CHECK(lw_plane_radiance(plane, point, behind, LW_PLANE_ALL, &bad) == LW_OK);
  CHECK(bad.validity == LW_INVALID_QUERY && bad.value[0] == 0);
  CHECK(lw_plane_diffuse(plane, outside, &bad) == LW_OK && bad.validity == LW_INVALID_QUERY);
  CHECK(lw_plane_radiance(plane, point, eye, 3, &bad) == LW_INVALID_ARGUMENT && bad.validity == LW_INVALID_QUERY);
  CHECK(lw_plane_radiance(plane, NULL, eye, 0, &bad) == LW_INVALID_ARGUMENT);
  CHECK(lw_plane_radiance(NULL, point, eye, 0, &bad) == LW_INVALID_ARGUMENT);
  CHECK(lw_plane_radiance(plane, point, eye, 0, NULL) == LW_INVALID_ARGUMENT);
  lw_plane_answer no_size;
  memset(&no_size, 0, sizeof no_size);
  CHECK(lw_plane_diffuse(plane, point, &no_size) == LW_INVALID_ARGUMENT);
}

static void an_image_shows_the_plane(const lw_plane* plane) {
  static float rgb[3 * 40 * 30];
  static uint8_t flags[40 * 30];
  lw_plane_camera camera = {.size = sizeof camera, .width = 40, .height = 30, .fx = 50, .fy = 50, .cx = 20, .cy = 15};
  camera.position[2] = 0.5;
  camera.orientation[3] = 1;
  lw_plane_rendering about = {.size = sizeof about};
  rgb[0] = 7;
  CHECK(lw_plane_render(plane, &camera, LW_PLANE_ALL, rgb, 3 * 40 * 30, flags, 40 * 30, &about) == LW_OK);
  /* 0.2 m in 0.5 m with 50 pixels: 20 x 20 pixels. */
  CHECK(about.validity == LW_VALID && about.pixels >= 380 && about.pixels <= 441);
  CHECK(rgb[0] == 7);
  const double middle[2] = {0, 0}, eye[3] = {0, 0, 0.5};
  lw_plane_answer answer = {.size = sizeof answer};
  CHECK(lw_plane_radiance(plane, middle, eye, LW_PLANE_ALL, &answer) == LW_OK);
  CHECK(near_to(rgb[3 * (15 * 40 + 20)], answer.value[0], 1e-6));
  CHECK(about.flags & LW_PLANE_CLIPPED_TEXEL);
  CHECK(about.flagged > 0 && about.flagged < about.pixels);
  CHECK(lw_plane_render(plane, &camera, LW_PLANE_ALL, rgb, 3 * 40 * 30, NULL, 0, NULL) == LW_OK);
  /* An orientation of zeros is the identity; any other is a unit quaternion. */
  lw_plane_rendering same = {.size = sizeof same};
  camera.orientation[3] = 0;
  CHECK(lw_plane_render(plane, &camera, LW_PLANE_ALL, rgb, 3 * 40 * 30, NULL, 0, &same) == LW_OK);
  CHECK(same.validity == LW_VALID && same.pixels == about.pixels && same.flagged == about.flagged);
  camera.orientation[3] = 0.5;
  CHECK(lw_plane_render(plane, &camera, LW_PLANE_ALL, rgb, 3 * 40 * 30, NULL, 0, &same) == LW_OK);
  CHECK(same.validity == LW_INVALID_QUERY && same.pixels == 0);
  camera.orientation[3] = 1;
  CHECK(lw_plane_render(plane, &camera, LW_PLANE_ALL, rgb, 40 * 30, NULL, 0, &about) == LW_OK);
  CHECK(about.validity == LW_INVALID_QUERY && about.pixels == 0);
  CHECK(lw_plane_render(plane, &camera, 7, rgb, 3 * 40 * 30, NULL, 0, &about) == LW_INVALID_ARGUMENT);
  CHECK(lw_plane_render(plane, NULL, 0, rgb, 3 * 40 * 30, NULL, 0, &about) == LW_INVALID_ARGUMENT);
  CHECK(lw_plane_render(plane, &camera, 0, NULL, 3 * 40 * 30, NULL, 0, &about) == LW_INVALID_ARGUMENT);
  CHECK(lw_plane_render(plane, &camera, 0, rgb, 3 * 40 * 30, NULL, 40 * 30, &about) == LW_INVALID_ARGUMENT);
}

static void coverage_guides(const lw_plane* plane) {
  lw_plane_guidance guidance = {.size = sizeof guidance};
  CHECK(lw_plane_get_guidance(plane, NULL, &guidance) == LW_OK);
  /* Node 24, the only unseen one, is on the horizon. */
  CHECK(near_to(guidance.seen, 1, 1e-12) && guidance.progress == LW_CAPTURE_ENOUGH && guidance.gap == 0);
  CHECK(guidance.next[0] == 0 && guidance.next[2] == 0 && near_to(guidance.circle, 0.8391, 1e-4));
  CHECK(guidance.probe[2] > 0.9);
  lw_plane_guidance_options options = {.size = sizeof options, .min_elevation = 1e-9};
  CHECK(lw_plane_get_guidance(plane, &options, &guidance) == LW_OK);
  /* Its neighbours on the level are 30 degrees of azimuth away, and those of the level above are not nearer. */
  CHECK(guidance.seen < 1 && guidance.progress == LW_CAPTURE_KEEP_MOVING && near_to(guidance.gap, 0.5236, 1e-3));
  CHECK(near_to(guidance.next[0], cos(11 * 0.52359878), 1e-6) && near_to(guidance.next[2], 0, 1e-9));
  float xy[2 * 30];
  uint8_t seen[30];
  size_t count = 0;
  CHECK(lw_plane_coverage(plane, NULL, NULL, 0, &count) == LW_OK && count == 25);
  CHECK(lw_plane_coverage(plane, xy, seen, 30, &count) == LW_OK && count == 25);
  CHECK(xy[0] == 0 && xy[1] == 0 && seen[0] == 1 && seen[24] == 0);
  CHECK(near_to(hypot(xy[48], xy[49]), 1, 1e-6));
  CHECK(lw_plane_coverage(plane, NULL, seen, 1, &count) == LW_INVALID_ARGUMENT);
}

static void handles_are_checked(lw_plane* plane) {
  lw_plane* copy = NULL;
  lw_lighting* light = NULL;
  CHECK(lw_plane_create(&copy) == LW_OK && lw_plane_copy(plane, copy) == LW_OK);
  CHECK(lw_plane_create(NULL) == LW_INVALID_ARGUMENT && lw_plane_reader_create(NULL) == LW_INVALID_ARGUMENT);
  CHECK(lw_lighting_create(&light) == LW_OK);
  CHECK(lw_plane_copy((const lw_plane*)light, copy) == LW_INVALID_ARGUMENT);
  CHECK(lw_plane_copy(plane, (lw_plane*)light) == LW_INVALID_ARGUMENT);
  CHECK(lw_plane_reader_take((lw_plane_reader*)plane, message, message_length, 0) == LW_INVALID_ARGUMENT);
  CHECK(strstr(lw_last_error(NULL), "lw_plane_reader") != NULL);
  lw_lighting_release(light);
  lw_plane_release(plane);
  /* The copy shares the state. */
  properties_are_those_of_the_message(copy);
  lw_plane_release(copy);
  lw_plane_release(NULL);
  lw_plane_reader_release(NULL);
}

int main(int argc, char** argv) {
  FILE* file = argc == 2 ? fopen(argv[1], "rb") : NULL;
  if (file == NULL) return 2;
  message_length = fread(message, 1, sizeof message, file);
  fclose(file);
  CHECK(message_length == 951);
  lw_plane* plane = received();
  properties_are_those_of_the_message(plane);
  answers_are_the_radiance(plane);
  an_image_shows_the_plane(plane);
  coverage_guides(plane);
  handles_are_checked(plane);
  return checks_failed(60);
}
