#include "link/discovery/advertiser.hpp"

#include <atomic>
#include <charconv>
#include <mutex>
#include <thread>

#include <avahi-client/client.h>
#include <avahi-client/publish.h>
#include <avahi-common/alternative.h>
#include <avahi-common/error.h>
#include <avahi-common/malloc.h>
#include <avahi-common/simple-watch.h>

#include <lightwell/text.hpp>
#include <lightwell/time.hpp>

namespace lightwell {
namespace {

constexpr std::int64_t kRetryNs = 1'000'000'000;
constexpr int kPollTimeoutMs = 200;
/// Renaming stops after this many collisions.
constexpr int kMaxRenames = 100;
/// Port of the service record if no link listens on this machine: that of the discard service.
constexpr std::uint16_t kNoPort = 9;
/// Limit of an instance name: one DNS label.
constexpr std::size_t kMaxLabelBytes = 63;

/// Port of the first link that listens on this machine.
std::uint16_t port_of(const Advertisement& a) {
  for (const AdvertisedLink& link : a.links) {
    const std::size_t at = link.uri.find("://:");
    if (at == std::string::npos) continue;
    std::uint16_t port = 0;
    std::from_chars(link.uri.data() + at + 4, link.uri.data() + link.uri.size(), port);
    if (port != 0) return port;
  }
  return kNoPort;
}

class AvahiAdvertiser final : public Advertiser {
 public:
  explicit AvahiAdvertiser(const Advertisement& advertisement)
      : instance_(truncated(advertisement.name, kMaxLabelBytes)),
        port_(port_of(advertisement)),
        poll_(avahi_simple_poll_new()) {
    for (const std::string& entry : advertisement_to_txt(advertisement)) {
      AvahiStringList* longer = avahi_string_list_add(txt_, entry.c_str());
      if (longer != nullptr) txt_ = longer;
    }
    txt_ = avahi_string_list_reverse(txt_);
    if (poll_ != nullptr) thread_ = std::thread([this] { run(); });
  }
  ~AvahiAdvertiser() override {
    stopping_ = true;
    if (thread_.joinable()) {
      avahi_simple_poll_wakeup(poll_);
      thread_.join();
    }
    avahi_string_list_free(txt_);
    if (poll_ != nullptr) avahi_simple_poll_free(poll_);
  }

  std::string announced_as() const override {
    const std::lock_guard lock(mutex_);
    return announced_;
  }
  std::string error_message() const override {
    const std::lock_guard lock(mutex_);
    return error_message_;
  }

 private:
  void run() {
    while (!stopping_) {
      if (client_ == nullptr && monotonic_now_ns() >= next_try_ns_) connect();
      // The timeout keeps retries on time; events of the daemon end the wait at once.
      if (avahi_simple_poll_iterate(poll_, kPollTimeoutMs) != 0) client_failed_ = true;
      if (client_failed_) disconnect();
      if (rename_) {
        rename_ = false;
        choose_alternative_name();
      }
    }
    disconnect();
  }

  /// With AVAHI_CLIENT_NO_FAIL Avahi waits for the daemon if D-Bus runs; without D-Bus, run() retries.
  void connect() {
    int error = 0;
    next_try_ns_ = monotonic_now_ns() + kRetryNs;
    AvahiClient* const made =
        avahi_client_new(avahi_simple_poll_get(poll_), AVAHI_CLIENT_NO_FAIL, on_client, this, &error);
    // The callback has run already, with the client that is about to be returned.
    client_ = made;
    if (made == nullptr) group_ = nullptr;
    if (made == nullptr) set_error_message(std::string("no connection to avahi-daemon: ") + avahi_strerror(error));
  }

  void disconnect() {
    client_failed_ = false;
    if (client_ != nullptr) avahi_client_free(client_);  // frees the group, too
    client_ = nullptr;
    group_ = nullptr;
  }

  static void on_client(AvahiClient* client, AvahiClientState state, void* data) {
    auto& self = *static_cast<AvahiAdvertiser*>(data);
    self.client_ = client;
    switch (state) {
      case AVAHI_CLIENT_S_RUNNING:
        self.publish();
        break;
      case AVAHI_CLIENT_S_COLLISION:
      case AVAHI_CLIENT_S_REGISTERING:
        // The host name changes: publish again once it is established.
        if (self.group_ != nullptr) avahi_entry_group_reset(self.group_);
        self.set_error_message("avahi-daemon is still establishing this machine's name");
        break;
      case AVAHI_CLIENT_CONNECTING:
        self.set_error_message("avahi-daemon is not running");
        break;
      case AVAHI_CLIENT_FAILURE:
        self.set_error_message(std::string("avahi-daemon disconnected: ") + avahi_strerror(avahi_client_errno(client)));
        self.client_failed_ = true;
        break;
    }
  }

  static void on_group(AvahiEntryGroup* group, AvahiEntryGroupState state, void* data) {
    auto& self = *static_cast<AvahiAdvertiser*>(data);
    self.group_ = group;
    if (state == AVAHI_ENTRY_GROUP_ESTABLISHED) {
      const std::lock_guard lock(self.mutex_);
      self.announced_ = self.instance_;
      self.error_message_.clear();
    } else if (state == AVAHI_ENTRY_GROUP_COLLISION) {
      self.rename_ = true;
    } else if (state == AVAHI_ENTRY_GROUP_FAILURE) {
      self.set_error_message(std::string("avahi-daemon refused: ") + avahi_strerror(avahi_client_errno(self.client_)));
      self.client_failed_ = true;
    }
  }

  void publish() {
    if (group_ == nullptr) group_ = avahi_entry_group_new(client_, on_group, this);
    if (group_ == nullptr) {
      client_failed_ = true;
      return;
    }
    if (!avahi_entry_group_is_empty(group_)) return;
    int rc =
        avahi_entry_group_add_service_strlst(group_, AVAHI_IF_UNSPEC, AVAHI_PROTO_UNSPEC, AvahiPublishFlags{},
                                             instance_.c_str(), kServiceType.data(), nullptr, nullptr, port_, txt_);
    if (rc == AVAHI_ERR_COLLISION) {
      // The name collides with another service of the same daemon.
      rename_ = true;
      return;
    }
    if (rc == 0) rc = avahi_entry_group_commit(group_);
    if (rc == 0) return;
    set_error_message(std::string("avahi-daemon refused: ") + avahi_strerror(rc));
    client_failed_ = true;
    next_try_ns_ = monotonic_now_ns() + kRetryNs;
  }

  void choose_alternative_name() {
    if (client_ == nullptr || ++renames_ > kMaxRenames) return;
    char* const other = avahi_alternative_service_name(instance_.c_str());
    instance_ = other;
    avahi_free(other);
    if (group_ != nullptr) avahi_entry_group_reset(group_);
    publish();
  }

  void set_error_message(const std::string& error_message) {
    const std::lock_guard lock(mutex_);
    announced_.clear();
    error_message_ = error_message;
  }

  // Used by the thread only.
  std::string instance_;
  const std::uint16_t port_;
  AvahiStringList* txt_ = nullptr;
  AvahiSimplePoll* const poll_;
  AvahiClient* client_ = nullptr;
  AvahiEntryGroup* group_ = nullptr;
  std::int64_t next_try_ns_ = 0;
  bool client_failed_ = false, rename_ = false;
  int renames_ = 0;

  std::atomic<bool> stopping_{false};
  mutable std::mutex mutex_;
  std::string announced_, error_message_ = "not announced yet";
  std::thread thread_;
};

}  // namespace

std::unique_ptr<Advertiser> make_advertiser(const Advertisement& advertisement) {
  return std::make_unique<AvahiAdvertiser>(advertisement);
}

}  // namespace lightwell
