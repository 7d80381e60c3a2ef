#include "client/connection/daemon_connection.h"

#include <optional>

#include <boost/asio/connect.hpp>
#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/ssl.hpp>
#include <boost/asio/write.hpp>

#include "core/base/str_cat.h"
#include "proto/wire/frame.h"

namespace atlas {

namespace asio = boost::asio;
using boost::system::error_code;
using std::chrono::milliseconds;

namespace {

constexpr std::size_t kChunkBytes = std::size_t{64} << 10;

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
  explicit Impl(Endpoint endpoint) : endpoint_(std::move(endpoint)), socket_(io_) {}
  ~Impl() { Close(); }
  Impl(const Impl&) = delete;
  Impl& operator=(const Impl&) = delete;
  Impl(Impl&&) = delete;
  Impl& operator=(Impl&&) = delete;

  Status Open(milliseconds timeout, const std::optional<ConnectionTls>& tls);
  Status Send(ByteSpan frame, milliseconds timeout);
  Result<Bytes> Receive(milliseconds timeout);
  Result<std::optional<Bytes>> Poll(milliseconds timeout);

  const Endpoint& endpoint() const { return endpoint_; }
  std::uint64_t bytes_sent() const { return bytes_sent_; }
  std::uint64_t bytes_received() const { return bytes_received_; }

 private:
  using Clock = std::chrono::steady_clock;

  // Runs what was started until `done` is set or the time is over.
  void Run(const std::optional<error_code>& done, Clock::time_point deadline);
  // The same; kTimeout, with the socket closed, if it was not done in time.
  Status Finish(const std::optional<error_code>& done,
                Clock::time_point deadline,
                const char* what);
  void StartRead();
  // False when nothing came: the read goes on.
  Result<bool> ReadSome(Clock::time_point deadline);
  Status Encrypt(const ConnectionTls& tls, Clock::time_point deadline);
  Result<asio::ip::tcp::resolver::results_type> Resolve(Clock::time_point deadline);
  Status Fail(StatusCode code, const std::string& what);
  // With all that was started: it refers to our buffers.
  void Close();

  Endpoint endpoint_;
  asio::io_context io_;
  asio::ip::tcp::socket socket_;
  asio::ssl::context tls_context_{asio::ssl::context::tlsv13_client};
  std::optional<asio::ssl::stream<asio::ip::tcp::socket&>> tls_;
  FrameDecoder decoder_;
  // One read at a time; it may outlive the call that started it.
  Bytes chunk_ = Bytes(kChunkBytes);
  bool is_reading_ = false;
  std::optional<error_code> read_;
  std::size_t read_bytes_ = 0;
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

Status DaemonConnection::Impl::Finish(const std::optional<error_code>& done,
                                      Clock::time_point deadline,
                                      const char* what) {
  Run(done, deadline);
  if (!done) return Fail(StatusCode::kTimeout, StrCat("timed out while ", what));
  if (*done) return Fail(StatusCode::kUnavailable, StrCat(what, ": ", done->message()));
  return {};
}

Result<asio::ip::tcp::resolver::results_type> DaemonConnection::Impl::Resolve(
    Clock::time_point deadline) {
  asio::ip::tcp::resolver resolver(io_);
  std::optional<error_code> done;
  asio::ip::tcp::resolver::results_type found;
  resolver.async_resolve(endpoint_.host, std::to_string(endpoint_.port),
                         asio::ip::tcp::resolver::numeric_service,
                         [&](const error_code& error, auto results) {
                           done = error;
                           found = std::move(results);
                         });
  if (Status status = Finish(done, deadline, "resolving its name"); !status.ok()) {
    return Error(std::move(status));
  }
  return found;
}

Status DaemonConnection::Impl::Open(milliseconds timeout, const std::optional<ConnectionTls>& tls) {
  const Clock::time_point deadline = Clock::now() + timeout;
  const auto addresses = Resolve(deadline);
  if (!addresses) return addresses.error();
  std::optional<error_code> done;
  asio::async_connect(socket_, *addresses,
                      [&](const error_code& error, const auto&) { done = error; });
  ATLAS_RETURN_IF_ERROR(Finish(done, deadline, "connecting"));
  error_code error;
  socket_.set_option(asio::ip::tcp::no_delay(true), error);
  if (error) return Fail(StatusCode::kUnavailable, error.message());
  return tls ? Encrypt(*tls, deadline) : Status();
}

Status DaemonConnection::Impl::Encrypt(const ConnectionTls& tls, Clock::time_point deadline) {
  if (Status status = UseFiles(tls, tls_context_); !status.ok()) {
    return Fail(status.code(), status.message());
  }
  const std::string& name = tls.daemon_name.empty() ? endpoint_.host : tls.daemon_name;
  tls_.emplace(socket_, tls_context_);
  tls_->set_verify_mode(asio::ssl::verify_peer);
  tls_->set_verify_callback(asio::ssl::host_name_verification(name));
  std::optional<error_code> done;
  tls_->async_handshake(asio::ssl::stream_base::client,
                        [&](const error_code& error) { done = error; });
  return Finish(done, deadline, StrCat("a TLS handshake, expecting ", name).c_str());
}

Status DaemonConnection::Impl::Send(ByteSpan frame, milliseconds timeout) {
  ATLAS_RETURN_IF_ERROR(failure_);
  std::optional<error_code> done;
  const auto finish = [&](const error_code& error, std::size_t) {
    done = error;
  };
  const auto bytes = asio::buffer(frame.data(), frame.size());
  if (tls_) {
    asio::async_write(*tls_, bytes, finish);
  } else {
    asio::async_write(socket_, bytes, finish);
  }
  ATLAS_RETURN_IF_ERROR(Finish(done, Clock::now() + timeout, "sending"));
  bytes_sent_ += frame.size();
  return {};
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
  if (*read_) {
    return Error(Fail(StatusCode::kUnavailable, StrCat("waiting for a reply: ", read_->message())));
  }
  bytes_received_ += read_bytes_;
  decoder_.Push(ByteSpan(chunk_).first(read_bytes_));
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

DaemonConnection::DaemonConnection(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
DaemonConnection::DaemonConnection(DaemonConnection&&) noexcept = default;
DaemonConnection& DaemonConnection::operator=(DaemonConnection&&) noexcept = default;
DaemonConnection::~DaemonConnection() = default;

Result<DaemonConnection> DaemonConnection::Open(const Endpoint& endpoint,
                                                milliseconds timeout,
                                                const std::optional<ConnectionTls>& tls) {
  auto impl = std::make_unique<Impl>(endpoint);
  if (Status status = impl->Open(timeout, tls); !status.ok()) return Error(std::move(status));
  return DaemonConnection(std::move(impl));
}

Status DaemonConnection::Send(ByteSpan frame, milliseconds timeout) {
  return impl_->Send(frame, timeout);
}

Result<Bytes> DaemonConnection::Receive(milliseconds timeout) {
  return impl_->Receive(timeout);
}

Result<std::optional<Bytes>> DaemonConnection::Poll(milliseconds timeout) {
  return impl_->Poll(timeout);
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
