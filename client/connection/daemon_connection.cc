#include "client/connection/daemon_connection.h"

#include <algorithm>
#include <optional>
#include <utility>
#include <vector>

#include <boost/asio/connect.hpp>
#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/ssl.hpp>
#include <boost/asio/steady_timer.hpp>
#include <boost/asio/write.hpp>
#include <netinet/in.h>
#include <netinet/tcp.h>
#include <sys/socket.h>

#include "client/connection/tls_hint.h"
#include "core/base/str_cat.h"
#include "proto/wire/frame.h"

namespace atlas {

namespace asio = boost::asio;
using boost::system::error_code;
using std::chrono::milliseconds;

namespace {

constexpr std::size_t kChunkBytes = std::size_t{64} << 10;

// Who waits for events alone notices within 2 min, too, that the daemon is gone without a word.
void HavePeerProbed(asio::ip::tcp::socket& socket) {
  error_code ignored;  // a system without it: silence is looked into by whoever asks something
  socket.set_option(asio::ip::tcp::socket::keep_alive(true), ignored);
  for (const auto& [option, value] :
       {std::pair(TCP_KEEPIDLE, 60), std::pair(TCP_KEEPINTVL, 15), std::pair(TCP_KEEPCNT, 4)}) {
    ::setsockopt(socket.native_handle(), IPPROTO_TCP, option, &value, sizeof(value));
  }
}

Status UseFiles(const ConnectionTls& tls, asio::ssl::context& context) {
  const auto refuse = [](const char* what, const std::filesystem::path& file,
                         const error_code& error) {
    return Status(StatusCode::kInvalidArgument,
                  StrCat("TLS: ", what, ' ', file.string(), ": ", error.message()));
  };
  error_code error;
  context.load_verify_file(tls.ca.string(), error);
  if (error) return refuse("authorities", tls.ca, error);
  if (tls.certificate.empty()) return {};
  context.use_certificate_chain_file(tls.certificate.string(), error);
  if (error) return refuse("certificate", tls.certificate, error);
  context.use_private_key_file(tls.key.string(), asio::ssl::context::pem, error);
  return error ? refuse("key", tls.key, error) : Status();
}

}  // namespace

class DaemonConnection::Impl {
 public:
  Impl(Endpoint endpoint,
       std::optional<ConnectionTls> tls,
       bool allow_plaintext,
       std::shared_ptr<NameLookup> names)
      : endpoint_(std::move(endpoint)),
        tls_options_(std::move(tls)),
        allow_plaintext_(allow_plaintext),
        names_(std::move(names)),
        socket_(io_) {}
  ~Impl() { Close(); }
  Impl(const Impl&) = delete;
  Impl& operator=(const Impl&) = delete;
  Impl(Impl&&) = delete;
  Impl& operator=(Impl&&) = delete;

  Result<bool> Open(Clock::time_point latest, Clock::time_point deadline);
  Result<bool> Flush(Clock::time_point latest, Clock::time_point deadline);
  Status Take(Bytes frame);
  Result<Bytes> Receive(milliseconds timeout);
  Result<std::optional<Bytes>> Poll(milliseconds timeout);

  bool is_closed() const { return !failure_.ok(); }
  const Endpoint& endpoint() const { return endpoint_; }
  std::uint64_t bytes_sent() const { return bytes_sent_; }
  std::uint64_t bytes_received() const { return bytes_received_; }

 private:
  enum class Stage : std::uint8_t { kResolving, kConnecting, kEncrypting, kOpen };

  // Runs what was started until `done` is set or the time is over.
  void Run(const std::optional<error_code>& done, Clock::time_point deadline);
  void StartRead();
  // False when nothing came: the read goes on.
  Result<bool> ReadSome(Clock::time_point deadline);
  // Ends a stage and begins the next; false when it has not ended at `latest`.
  Result<bool> Step(Clock::time_point latest, Clock::time_point deadline);
  Result<bool> Resolve(Clock::time_point latest, Clock::time_point deadline);
  // Whether all addresses may be connected to.
  Status CheckAddresses();
  // One address after the other, each with an equal part of the time: of a host with several the
  // first may be one that never answers.
  void Connect(Clock::time_point deadline);
  // Connected: encrypts, if it is to be.
  Status BeginTalking();
  std::string Doing() const;
  const std::string& DaemonName() const;
  Status Fail(StatusCode code, const std::string& what);
  // With all that was started: it refers to our buffers.
  void Close();

  Endpoint endpoint_;
  std::optional<ConnectionTls> tls_options_;
  bool allow_plaintext_;
  std::shared_ptr<NameLookup> names_;
  Stage stage_ = Stage::kResolving;
  std::vector<asio::ip::tcp::endpoint> addresses_;
  std::optional<error_code> opened_;  // of the stage
  asio::io_context io_;
  asio::ip::tcp::socket socket_;
  asio::steady_timer turn_{io_};  // of an address
  asio::ssl::context tls_context_{asio::ssl::context::tlsv13_client};
  std::optional<asio::ssl::stream<asio::ip::tcp::socket&>> tls_;
  FrameDecoder decoder_;
  // One read at a time; it may outlive the call that started it.
  Bytes chunk_ = Bytes(kChunkBytes);
  bool is_reading_ = false;
  std::optional<error_code> read_;
  std::size_t read_bytes_ = 0;
  // One frame at a time; likewise.
  Bytes outgoing_;
  bool is_sending_ = false;
  std::optional<error_code> sent_;
  std::uint64_t bytes_sent_ = 0;
  std::uint64_t bytes_received_ = 0;
  Status failure_;
};

Status DaemonConnection::Impl::Fail(StatusCode code, const std::string& what) {
  Close();
  failure_ = Status(code, StrCat("daemon at ", endpoint_.ToText(), ": ", what));
  return failure_;
}

void DaemonConnection::Impl::Close() {
  error_code ignored;  // closing is all that is left to do
  socket_.close(ignored);
  turn_.cancel();
  io_.restart();
  io_.run();
}

void DaemonConnection::Impl::Run(const std::optional<error_code>& done,
                                 Clock::time_point deadline) {
  io_.restart();
  io_.poll();  // what is there already, however late it is
  while (!done && io_.run_one_until(deadline) > 0) {
  }
}

Result<bool> DaemonConnection::Impl::Open(Clock::time_point latest, Clock::time_point deadline) {
  if (!failure_.ok()) return Error(failure_);
  while (stage_ != Stage::kOpen) {
    const Result<bool> is_done = Step(std::min(latest, deadline), deadline);
    if (!is_done) return is_done;
    if (*is_done) continue;
    if (Clock::now() < deadline) return false;
    return Error(Fail(StatusCode::kTimeout, "timed out while " + Doing()));
  }
  return true;
}

Result<bool> DaemonConnection::Impl::Step(Clock::time_point latest, Clock::time_point deadline) {
  if (stage_ == Stage::kResolving) return Resolve(latest, deadline);
  Run(opened_, latest);
  if (!opened_) return false;
  if (*opened_) {
    const auto hint = stage_ == Stage::kEncrypting ? MayNotSpeakTls(*opened_) : "";
    return Error(Fail(StatusCode::kUnavailable, StrCat(Doing(), ": ", opened_->message(), hint)));
  }
  Status begun = stage_ == Stage::kConnecting ? BeginTalking() : Status();
  if (!begun.ok()) return Error(std::move(begun));
  stage_ = stage_ == Stage::kConnecting && tls_options_ ? Stage::kEncrypting : Stage::kOpen;
  return true;
}

std::string DaemonConnection::Impl::Doing() const {
  if (stage_ == Stage::kResolving) return "resolving its name";
  if (stage_ == Stage::kConnecting) return "connecting";
  return "a TLS handshake, expecting " + DaemonName();
}

const std::string& DaemonConnection::Impl::DaemonName() const {
  return tls_options_->daemon_name.empty() ? endpoint_.host : tls_options_->daemon_name;
}

Result<bool> DaemonConnection::Impl::Resolve(Clock::time_point latest, Clock::time_point deadline) {
  const auto found = names_->Find(endpoint_.host, latest);
  if (!found)
    return Error(Fail(found.error().code(), StrCat(Doing(), ": ", found.error().message())));
  if (!*found) return false;
  for (const std::string& text : **found) {
    error_code error;
    const auto address = asio::ip::make_address(text, error);
    if (!error) addresses_.emplace_back(address, endpoint_.port);
  }
  if (Status status = CheckAddresses(); !status.ok()) return Error(std::move(status));
  stage_ = Stage::kConnecting;
  Connect(deadline);
  return true;
}

Status DaemonConnection::Impl::CheckAddresses() {
  if (tls_options_ || allow_plaintext_) return {};
  const auto beyond = std::find_if(addresses_.begin(), addresses_.end(), [](const auto& endpoint) {
    return !endpoint.address().is_loopback();
  });
  if (beyond == addresses_.end()) return {};
  return Fail(StatusCode::kInvalidArgument,
              StrCat(beyond->address().to_string(),
                     " is not this machine, and nothing is sent there in the clear: expected TLS "
                     "(--tls-ca), or that it is allowed (--allow-plaintext)"));
}

void DaemonConnection::Impl::Connect(Clock::time_point deadline) {
  const auto share = (deadline - Clock::now()) / std::max<std::size_t>(1, addresses_.size());
  const auto begin_turn = [this, share](const error_code&, const asio::ip::tcp::endpoint& next) {
    turn_.cancel();
    if (next == addresses_.back()) return true;  // what is left is its own
    turn_.expires_after(share);
    turn_.async_wait([this](const error_code& error) {
      error_code ignored;  // it is connected by now
      if (!error && !opened_) socket_.cancel(ignored);
    });
    return true;
  };
  asio::async_connect(socket_, addresses_, begin_turn,
                      [this](const error_code& error, const asio::ip::tcp::endpoint&) {
                        opened_ = error;
                        turn_.cancel();
                      });
}

Status DaemonConnection::Impl::BeginTalking() {
  error_code refused;
  socket_.set_option(asio::ip::tcp::no_delay(true), refused);
  if (refused) return Fail(StatusCode::kUnavailable, refused.message());
  HavePeerProbed(socket_);
  if (!tls_options_) return {};
  if (Status status = UseFiles(*tls_options_, tls_context_); !status.ok()) {
    return Fail(status.code(), status.message());
  }
  opened_.reset();
  tls_.emplace(socket_, tls_context_);
  tls_->set_verify_mode(asio::ssl::verify_peer);
  tls_->set_verify_callback(asio::ssl::host_name_verification(DaemonName()));
  tls_->async_handshake(asio::ssl::stream_base::client,
                        [this](const error_code& error) { opened_ = error; });
  return {};
}

Status DaemonConnection::Impl::Take(Bytes frame) {
  ATLAS_RETURN_IF_ERROR(failure_);
  outgoing_ = std::move(frame);
  bytes_sent_ += outgoing_.size();
  is_sending_ = true;
  sent_.reset();
  const auto finish = [this](const error_code& error, std::size_t) {
    sent_ = error;
  };
  if (tls_) {
    asio::async_write(*tls_, asio::buffer(outgoing_), finish);
  } else {
    asio::async_write(socket_, asio::buffer(outgoing_), finish);
  }
  return {};
}

Result<bool> DaemonConnection::Impl::Flush(Clock::time_point latest, Clock::time_point deadline) {
  if (!failure_.ok()) return Error(failure_);
  if (!is_sending_) return true;
  Run(sent_, std::min(latest, deadline));
  if (!sent_ && Clock::now() < deadline) return false;
  if (!sent_) return Error(Fail(StatusCode::kTimeout, "timed out while sending"));
  is_sending_ = false;
  if (*sent_) return Error(Fail(StatusCode::kUnavailable, StrCat("sending: ", sent_->message())));
  return true;
}

void DaemonConnection::Impl::StartRead() {
  is_reading_ = true;
  read_.reset();
  const auto finish = [this](const error_code& error, std::size_t bytes) {
    read_ = error;
    read_bytes_ = bytes;
  };
  if (tls_) {
    tls_->async_read_some(asio::buffer(chunk_), finish);
  } else {
    socket_.async_read_some(asio::buffer(chunk_), finish);
  }
}

Result<bool> DaemonConnection::Impl::ReadSome(Clock::time_point deadline) {
  if (!is_reading_) StartRead();
  Run(read_, deadline);
  if (!read_) return false;
  is_reading_ = false;
  const bool is_first = bytes_received_ == 0 && !tls_;
  const ByteSpan came = ByteSpan(chunk_).first(*read_ ? 0 : read_bytes_);
  if (*read_ || (is_first && IsTlsAlert(came))) {
    return Error(
        Fail(StatusCode::kUnavailable,
             StrCat("waiting for a reply: ", *read_ ? read_->message() : "a TLS alert came",
                    is_first ? kMayExpectTls : "")));
  }
  bytes_received_ += read_bytes_;
  decoder_.Push(came);
  return true;
}

Result<std::optional<Bytes>> DaemonConnection::Impl::Poll(milliseconds timeout) {
  if (!failure_.ok()) return Error(failure_);
  const Clock::time_point deadline = Clock::now() + timeout;
  while (true) {
    const Result<std::optional<ByteSpan>> payload = decoder_.Next();
    if (!payload) return Error(Fail(payload.error().code(), payload.error().message()));
    if (*payload) return Bytes((*payload)->begin(), (*payload)->end());
    const Result<bool> came = ReadSome(deadline);
    if (!came) return Error(came.error());
    if (!*came) return std::nullopt;
  }
}

Result<Bytes> DaemonConnection::Impl::Receive(milliseconds timeout) {
  Result<std::optional<Bytes>> payload = Poll(timeout);
  if (!payload) return Error(payload.error());
  if (!*payload) {
    return Error(Fail(StatusCode::kTimeout, "timed out while waiting for a reply"));
  }
  return **std::move(payload);
}

DaemonConnection::DaemonConnection(const Endpoint& endpoint,
                                   const std::optional<ConnectionTls>& tls,
                                   bool allow_plaintext,
                                   std::shared_ptr<NameLookup> names)
    : impl_(std::make_unique<Impl>(endpoint, tls, allow_plaintext, std::move(names))) {}
DaemonConnection::DaemonConnection(DaemonConnection&&) noexcept = default;
DaemonConnection& DaemonConnection::operator=(DaemonConnection&&) noexcept = default;
DaemonConnection::~DaemonConnection() = default;

Result<bool> DaemonConnection::Open(Clock::time_point latest, Clock::time_point deadline) {
  return impl_->Open(latest, deadline);
}

Result<bool> DaemonConnection::Flush(Clock::time_point latest, Clock::time_point deadline) {
  return impl_->Flush(latest, deadline);
}

Status DaemonConnection::Take(Bytes frame) {
  return impl_->Take(std::move(frame));
}

Result<Bytes> DaemonConnection::Receive(milliseconds timeout) {
  return impl_->Receive(timeout);
}

Result<std::optional<Bytes>> DaemonConnection::Poll(milliseconds timeout) {
  return impl_->Poll(timeout);
}

bool DaemonConnection::is_closed() const {
  return impl_->is_closed();
}

const Endpoint& DaemonConnection::endpoint() const {
  return impl_->endpoint();
}

std::uint64_t DaemonConnection::bytes_sent() const {
  return impl_->bytes_sent();
}

std::uint64_t DaemonConnection::bytes_received() const {
  return impl_->bytes_received();
}

}  // namespace atlas
