#include "structure/skeletons/link/count_link.hpp"

namespace lightwell {
namespace {

class CountLinkImpl final : public CountLink {
 public:
  explicit CountLinkImpl(const CountConfig& config) : address_("count://" + config.name) {}

  Status start() override { return {}; }
  void publish(const EncodedDescriptor& /*descriptor*/) override { ++count_; }
  void stop() override {}
  LinkCounters counters() const override { return {}; }
  std::string_view name() const override { return "count"; }
  std::string address() const override { return address_; }
  std::uint64_t count() const override { return count_; }

 private:
  const std::string address_;
  std::atomic<std::uint64_t> count_{0};
};

}  // namespace

std::unique_ptr<CountLink> make_count_link(const CountConfig& config, Commands& /*commands*/) {
  return std::make_unique<CountLinkImpl>(config);
}

}  // namespace lightwell
