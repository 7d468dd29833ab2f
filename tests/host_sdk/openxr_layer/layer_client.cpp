#include "host_sdk/openxr_layer/layer_client.hpp"

#include <cstring>
#include <filesystem>
#include <sstream>

namespace lightwell::test {
namespace {

/// Words of a line: numbers, and floats as the hexadecimal digits of their bits.
class Words {
 public:
  explicit Words(const std::string& line) : in_(line) {}

  template <class T>
  Words& operator>>(T& out) {
    in_ >> out;
    return *this;
  }
  template <std::size_t N>
  Words& operator>>(std::array<float, N>& out) {
    for (float& value : out) {
      std::string digits;
      in_ >> digits;
      const auto bits = static_cast<std::uint32_t>(std::stoul(digits, nullptr, 16));
      std::memcpy(&value, &bits, sizeof bits);
    }
    return *this;
  }
  [[nodiscard]] bool whole() const { return !in_.fail(); }

 private:
  std::istringstream in_;
};

}  // namespace

ChildOptions layer_environment(const TempDir& folder, const LayerSetup& setup) {
  const std::string manifest =
      folder.write("runtime.json", std::string(R"({"file_format_version": "1.0.0", )") +
                                       R"("runtime": {"library_path": ")" SIMULATED_XR_RUNTIME R"("}})");
  std::filesystem::create_directories(folder.path("data/openxr/1"));
  const bool implicit = setup.kind == LayerKind::implicit_layer;
  if (implicit && !std::filesystem::exists(folder.path("data/openxr/1/api_layers"))) {
    std::filesystem::create_directories(folder.path("data/openxr/1/api_layers"));
    std::filesystem::create_directory_symlink(OPENXR_LAYER_MANIFESTS "/implicit.d",
                                              folder.path("data/openxr/1/api_layers/implicit.d"));
  }
  ChildOptions out;
  out.environment = {"XR_RUNTIME_JSON=" + manifest, "XDG_DATA_HOME=" + folder.path("data"),
                     // The layer connects only to what a test names, with credentials that it names.
                     "XDG_CONFIG_HOME=" + folder.path("config"),
                     // Overrides this process's options: the leaks are the loader's.
                     "LSAN_OPTIONS=print_suppressions=0:suppressions=" LSAN_SUPPRESSIONS};
  if (setup.kind == LayerKind::explicit_layer) {
    out.environment.push_back("XR_API_LAYER_PATH=" OPENXR_LAYER_MANIFESTS "/explicit.d");
    out.environment.push_back("XR_ENABLE_API_LAYERS=XR_APILAYER_LIGHTWELL_light_estimation");
  }
  out.environment.insert(out.environment.end(), setup.environment.begin(), setup.environment.end());
  return out;
}

std::vector<std::string> client_command(std::vector<std::string> arguments) {
  arguments.insert(arguments.begin(), OPENXR_LIGHT_CLIENT);
  return arguments;
}

std::vector<std::string> lines_of(const std::string& out, const std::string& word) {
  std::vector<std::string> found;
  std::istringstream in(out);
  for (std::string line; std::getline(in, line) && !in.eof();)
    if (line.starts_with(word + " ")) found.push_back(line.substr(word.size() + 1));
  return found;
}

std::vector<LightLine> light_lines(const std::string& out) {
  std::vector<LightLine> lines;
  for (const std::string& text : lines_of(out, "light")) {
    LightLine l;
    Words words(text);
    words >> l.session >> l.host_ns >> l.took_ns >> l.time >> l.result >> l.state >> l.updated >> l.T_space_local >>
        l.directional_state >> l.directional >> l.ambient_state >> l.ambient >> l.harmonics_state >> l.coefficients;
    EXPECT_TRUE(words.whole()) << text;
    lines.push_back(l);
  }
  return lines;
}

std::vector<CubeLine> cube_lines(const std::string& out) {
  std::vector<CubeLine> lines;
  for (const std::string& text : lines_of(out, "cube")) {
    CubeLine c;
    Words words(text);
    words >> c.session >> c.state >> c.center_exposure >> c.rotation >> c.hash;
    EXPECT_TRUE(words.whole()) << text;
    lines.push_back(c);
  }
  return lines;
}

}  // namespace lightwell::test
