#include "tools/lightwell_calibrate/world_tags.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include <lightwell/files.hpp>
#include <lightwell/text.hpp>

#include "imaging/uri.hpp"

namespace lightwell::calibrate {

namespace {

const std::vector<std::string_view> kColumns = {"family", "id", "size_m", "tx", "ty", "tz", "qx", "qy", "qz", "qw"};
enum Column : std::size_t { kFamily, kId };  // The others are numbers.

}  // namespace

Result<std::vector<WorldTag>> parse_world_tags(std::string_view text, const std::string& name) {
  std::vector<WorldTag> out;
  std::vector<std::size_t> order;  // Index in kColumns of each cell of a line.
  int line_number = 0;
  const auto wrong = [&](const std::string& what) {
    return Status(StatusCode::invalid_argument, name + ":" + std::to_string(line_number) + ": " + what);
  };
  while (!text.empty()) {
    const auto end = text.find('\n');
    const std::string_view line = text.substr(0, end);
    text = end == std::string_view::npos ? std::string_view() : text.substr(end + 1);
    ++line_number;
    const std::vector<std::string_view> cells = comma_separated(line);
    if ((cells.size() == 1 && cells[0].empty()) || cells[0].starts_with('#')) continue;
    if (order.empty()) {
      for (const std::string_view cell : cells) {
        const auto column = std::find(kColumns.begin(), kColumns.end(), cell);
        if (column == kColumns.end()) {
          const std::string near = nearest_name(cell, kColumns);
          return wrong("unknown column '" + std::string(cell) + "'" +
                       (near.empty() ? "" : "; did you mean '" + near + "'?"));
        }
        const auto index = static_cast<std::size_t>(column - kColumns.begin());
        if (std::find(order.begin(), order.end(), index) != order.end())
          return wrong("column " + std::string(cell) + " is listed twice");
        order.push_back(index);
      }
      for (std::size_t i = kId; i < kColumns.size(); ++i)
        if (std::find(order.begin(), order.end(), i) == order.end())
          return wrong("column " + std::string(kColumns[i]) + " is missing");
      continue;
    }
    if (cells.size() != order.size())
      return wrong(std::to_string(cells.size()) + " cells, where the first line names " + std::to_string(order.size()));
    WorldTag tag;
    Vec3d& t = tag.world_tag.translation;
    Quat& q = tag.world_tag.rotation;
    const std::array<double*, 10> numbers = {nullptr, nullptr, &tag.size_m, &t.x, &t.y, &t.z, &q.x, &q.y, &q.z, &q.w};
    for (std::size_t i = 0; i < cells.size(); ++i) {
      const std::string text(cells[i]);
      if (order[i] == kFamily) {
        const Result<TagFamily> family = parse_tag_family(text);
        if (!family) return wrong(family.status().message());
        tag.family = *family;
      } else if (order[i] == kId) {
        tag.id = parse_number<int>(text).value_or(-1);
        if (tag.id < 0) return wrong("id: '" + text + "' is not a tag's number");
      } else {
        const auto value = parse_number<double>(text);
        if (!value) return wrong(std::string(kColumns[order[i]]) + ": '" + text + "' is not a number");
        *numbers[order[i]] = *value;
      }
    }
    if (tag.id >= shape_of(tag.family).tags)
      return wrong(std::string(to_string(tag.family)) + " has no tag " + std::to_string(tag.id));
    if (!(tag.size_m > 0)) return wrong("size_m must be positive, in metres");
    const double norm = std::sqrt(q.x * q.x + q.y * q.y + q.z * q.z + q.w * q.w);
    if (!(std::abs(norm - 1) < 1e-3)) return wrong("the quaternion's length is " + std::to_string(norm) + ", not 1");
    q = q.normalized();
    for (const WorldTag& other : out)
      if (other.family == tag.family && other.id == tag.id)
        return wrong(std::string(to_string(tag.family)) + " " + std::to_string(tag.id) + " is listed twice");
    out.push_back(tag);
  }
  if (out.empty()) return Status(StatusCode::invalid_argument, name + ": lists no tag");
  return out;
}

Result<std::vector<WorldTag>> load_world_tags(const std::string& path) {
  const Result<std::string> text = read_text_file(path);
  if (!text) return text.status();
  return parse_world_tags(*text, path);
}

}  // namespace lightwell::calibrate
