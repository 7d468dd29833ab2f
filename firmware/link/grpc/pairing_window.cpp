#include "link/grpc/pairing_window.hpp"

#include <condition_variable>
#include <ctime>
#include <map>
#include <mutex>

#include <grpcpp/grpcpp.h>

#include <lightwell/pairing.hpp>
#include <lightwell/secrets.hpp>

#include "lightwell/v1/pairing.grpc.pb.h"
#include "link/access/bind_policy.hpp"
#include "link/grpc/rpc_status.hpp"
#include "link/grpc/transport.hpp"

namespace lightwell {
namespace {

using Clock = std::chrono::steady_clock;

/// Limit of a request; a PairFinishRequest has about 400 bytes.
constexpr int kMaxRequestBytes = 4096;

using Base = v1::PairingService::WithCallbackMethod_Begin<
    v1::PairingService::WithCallbackMethod_Finish<v1::PairingService::Service>>;

/// Holds the exchanges in progress and the outcome of the window.
class Service final : public Base {
 public:
  Service(PairingWindowOptions options, ProbeKeys keys, std::string code, std::string digest)
      : options_(std::move(options)),
        keys_(std::move(keys)),
        code_(std::move(code)),
        digest_(std::move(digest)),
        end_(Clock::now() + options_.open_for) {}

  const std::string& code() const { return code_; }

  grpc::ServerUnaryReactor* Begin(grpc::CallbackServerContext* context, const v1::PairBeginRequest* request,
                                  v1::PairBeginResponse* response) override {
    return finished(context, begin(*request, *response));
  }
  grpc::ServerUnaryReactor* Finish(grpc::CallbackServerContext* context, const v1::PairFinishRequest* request,
                                   v1::PairFinishResponse* response) override {
    return finished(context, finish(*request, *response));
  }

  PairingOutcome wait(std::chrono::milliseconds timeout) {
    std::unique_lock lock(mutex_);
    closed_.wait_until(lock, std::min(Clock::now() + timeout, end_),
                       [this] { return outcome_ != PairingOutcome::open; });
    close_when_over();
    return outcome_;
  }
  std::string client_name() const {
    const std::lock_guard lock(mutex_);
    return client_name_;
  }
  int wrong_codes() const {
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
};

}  // namespace

struct PairingWindow::Impl {
  std::unique_ptr<Service> service;
  std::unique_ptr<grpc::Server> server;
  std::string host;
  int port = 0;
};

PairingWindow::PairingWindow(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}

PairingWindow::~PairingWindow() {
  // The response that closed the window may not have been sent yet.
  impl_->server->Shutdown(std::chrono::system_clock::now() + std::chrono::milliseconds(500));
  impl_->server->Wait();
}

Result<std::unique_ptr<PairingWindow>> PairingWindow::open(const PairingWindowOptions& options, const ProbeKeys& keys) {
  if (!is_host_and_port(options.listen)) return listen_error(options.listen, "--pair-listen");
  Result<std::string> code = random_code();
  if (!code) return code.status();
  const Result<std::string> digest = certificate_digest(keys.certificate);
  if (!digest) return digest.status();
  auto impl = std::make_unique<Impl>();
  impl->service = std::make_unique<Service>(options, keys, std::move(*code), *digest);
  impl->host = options.listen.substr(0, options.listen.rfind(':'));
  grpc::ServerBuilder builder;
  builder.AddListeningPort(options.listen, tls_credentials(keys, ClientCertificates::not_requested), &impl->port);
  builder.RegisterService(impl->service.get());
  set_limits(builder);
  builder.SetMaxReceiveMessageSize(kMaxRequestBytes);
  impl->server = builder.BuildAndStart();
  if (!impl->server || impl->port == 0) return listen_error(options.listen, "--pair-listen");
  return std::unique_ptr<PairingWindow>(new PairingWindow(std::move(impl)));
}

const std::string& PairingWindow::code() const { return impl_->service->code(); }
std::string PairingWindow::address() const { return "grpcs://" + impl_->host + ":" + std::to_string(impl_->port); }
std::string PairingWindow::client_name() const { return impl_->service->client_name(); }
int PairingWindow::wrong_codes() const { return impl_->service->wrong_codes(); }
PairingOutcome PairingWindow::wait(std::chrono::milliseconds timeout) { return impl_->service->wait(timeout); }

}  // namespace lightwell
