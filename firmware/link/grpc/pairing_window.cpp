#include "link/grpc/pairing_window.hpp"

#include <condition_variable>
#include <ctime>
#include <map>
#include <mutex>

#include <grpcpp/grpcpp.h>

#include <lightwell/pairing.hpp>
#include <lightwell/secrets.hpp>

#include "lightwell/v1/pairing.grpc.pb.h"
#include "link/access/listen_address.hpp"
#include "link/grpc/transport.hpp"

namespace lightwell {
namespace {

using Clock = std::chrono::steady_clock;

/// Limit of a request; a PairFinishRequest has about 400 bytes.
constexpr int kMaxPairingRequestBytes = 4096;

using Base = v1::PairingService::WithCallbackMethod_Begin<
    v1::PairingService::WithCallbackMethod_Finish<v1::PairingService::Service>>;

/// The service with its server, the exchanges in progress and the outcome.
class Window final : public PairingWindow, private Base {
 public:
  Window(PairingWindowOptions options, ProbeKeys keys, std::string code, std::string digest)
      : options_(std::move(options)),
        keys_(std::move(keys)),
        code_(std::move(code)),
        digest_(std::move(digest)),
        end_(Clock::now() + options_.open_for) {}

  ~Window() override {
    if (!server_) return;
    // The response that closed the window may not have been sent yet.
    server_->Shutdown(std::chrono::system_clock::now() + std::chrono::milliseconds(500));
    server_->Wait();
  }

  /// False if the server cannot listen.
  [[nodiscard]] bool start() {
    grpc::ServerBuilder builder;
    builder.AddListeningPort(options_.listen, tls_credentials(keys_), &port_);
    builder.RegisterService(this);
    set_limits(builder);
    builder.SetMaxReceiveMessageSize(kMaxPairingRequestBytes);
    server_ = builder.BuildAndStart();
    return server_ && port_ != 0;
  }

  const std::string& code() const override { return code_; }
  std::string address() const override {
    return "grpcs://" + options_.listen.substr(0, options_.listen.rfind(':')) + ":" + std::to_string(port_);
  }

  grpc::ServerUnaryReactor* Begin(grpc::CallbackServerContext* context, const v1::PairBeginRequest* request,
                                  v1::PairBeginResponse* response) override {
    return finished(context, begin(*request, *response));
  }
  grpc::ServerUnaryReactor* Finish(grpc::CallbackServerContext* context, const v1::PairFinishRequest* request,
                                   v1::PairFinishResponse* response) override {
    return finished(context, finish(*request, *response));
  }

  PairingOutcome wait(std::chrono::milliseconds timeout) override {
    std::unique_lock lock(mutex_);
    closed_.wait_until(lock, std::min(Clock::now() + timeout, end_),
                       [this] { return outcome_ != PairingOutcome::open; });
    close_when_over();
    return outcome_;
  }
  std::string client_name() const override {
    const std::lock_guard lock(mutex_);
    return client_name_;
  }
  int wrong_codes() const override {
    const std::lock_guard lock(mutex_);
    return wrong_codes_;
  }

 private:
  static grpc::ServerUnaryReactor* finished(grpc::CallbackServerContext* context, const grpc::Status& status) {
    grpc::ServerUnaryReactor* reactor = context->DefaultReactor();
    reactor->Finish(status);
    return reactor;
  }
  static grpc::Status closed() {
    return {grpc::StatusCode::FAILED_PRECONDITION,
            "the pairing window is closed: open another with `lightwelld --pair`, which shows a new code"};
  }
  static grpc::Status wrong_code() {
    return {
        grpc::StatusCode::UNAUTHENTICATED,
        "the code is not the one that the probe shows, or somebody stands between; look at the probe and try again"};
  }

  void close_when_over() {
    if (outcome_ == PairingOutcome::open && Clock::now() >= end_) close(PairingOutcome::timed_out);
  }
  void close(PairingOutcome outcome) {
    outcome_ = outcome;
    exchanges_.clear();
    closed_.notify_all();
  }

  grpc::Status begin(const v1::PairBeginRequest& request, v1::PairBeginResponse& response) {
    const std::lock_guard lock(mutex_);
    close_when_over();
    if (outcome_ != PairingOutcome::open) return closed();
    if (begun_ == PairingWindow::kMaxExchanges)
      return {grpc::StatusCode::RESOURCE_EXHAUSTED,
              "too many clients have begun to pair in this window; open another on the probe"};
    ++begun_;
    Result<PairingExchange> exchange = PairingExchange::begin(PairingSide::probe, code_);
    if (!exchange) return rpc_status(exchange.status());
    if (const Status s = exchange->process_peer_share(request.share(), digest_); !s.ok()) return rpc_status(s);
    Result<std::string> session = random_bytes(16);
    if (!session) return rpc_status(session.status());
    response.set_session(*session);
    response.set_share(exchange->share());
    exchanges_.insert_or_assign(std::move(*session), std::move(*exchange));
    return grpc::Status::OK;
  }

  grpc::Status finish(const v1::PairFinishRequest& request, v1::PairFinishResponse& response) {
    const std::lock_guard lock(mutex_);
    close_when_over();
    if (outcome_ != PairingOutcome::open) return closed();
    // Removed in any case: an exchange allows one guess.
    auto node = exchanges_.extract(request.session());
    // An unknown session is not counted as a guess; otherwise three invented sessions would close the window.
    if (node.empty()) return wrong_code();
    if (!node.mapped().confirms(request.confirmation())) {
      if (++wrong_codes_ == PairingWindow::kMaxWrongCodes) close(PairingOutcome::too_many_wrong_codes);
      return wrong_code();
    }
    PairingExchange exchange = std::move(node.mapped());
    const Result<std::string> opened = exchange.open(request.sealed());
    v1::PairApplication application;
    if (!opened || !application.ParseFromString(*opened))
      return {grpc::StatusCode::INVALID_ARGUMENT, "the sealed application does not belong to this exchange"};
    const Result<ClientCredentials> client = register_client(keys_, application.client_name(), application.public_key(),
                                                             options_.client_certificate_days, std::time(nullptr));
    if (!client) return rpc_status(client.status());
    v1::PairCredentials credentials;
    credentials.set_probe_name(options_.probe_name);
    credentials.set_port(static_cast<std::uint32_t>(options_.port));
    credentials.set_probe_ca(keys_.trust);
    credentials.set_client_certificate(client->certificate);
    credentials.set_token(client->token);
    credentials.set_expires_s(client->expires_s);
    response.set_confirmation(exchange.confirmation());
    Result<SealedMessage> sealed = std::move(exchange).seal(credentials.SerializeAsString());
    if (!sealed) return rpc_status(sealed.status());
    response.set_sealed(std::move(sealed->bytes));
    client_name_ = application.client_name();
    close(PairingOutcome::paired);
    return grpc::Status::OK;
  }

  const PairingWindowOptions options_;
  const ProbeKeys keys_;
  const std::string code_, digest_;
  const Clock::time_point end_;
  mutable std::mutex mutex_;
  std::condition_variable closed_;
  std::map<std::string, PairingExchange, std::less<>> exchanges_;
  int begun_ = 0, wrong_codes_ = 0;
  std::string client_name_;
  PairingOutcome outcome_ = PairingOutcome::open;
  int port_ = 0;
  std::unique_ptr<grpc::Server> server_;
};

}  // namespace

Result<std::unique_ptr<PairingWindow>> PairingWindow::open(const PairingWindowOptions& options, const ProbeKeys& keys) {
  if (!is_host_and_port(options.listen)) return listen_error(options.listen, "--pair-listen");
  Result<std::string> code = random_code();
  if (!code) return code.status();
  const Result<std::string> digest = certificate_digest(keys.certificate);
  if (!digest) return digest.status();
  auto window = std::make_unique<Window>(options, keys, std::move(*code), *digest);
  if (!window->start()) return listen_error(options.listen, "--pair-listen");
  return std::unique_ptr<PairingWindow>(std::move(window));
}

}  // namespace lightwell
