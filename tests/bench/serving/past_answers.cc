#include "tests/bench/serving/past_answers.h"

#include <array>
#include <chrono>
#include <memory>
#include <thread>
#include <utility>

#include "client/connection/atlas_client.h"
#include "core/base/str_cat.h"
#include "tests/bench/serving/load_frames.h"
#include "tests/bench/serving/load_socket.h"

namespace atlas::testing {
namespace {

using Clock = std::chrono::steady_clock;
using std::chrono::milliseconds;

constexpr int kQueries = 5;
constexpr double kRadius_m = 20.0;
constexpr milliseconds kTimeToAnswer{2'000};
constexpr milliseconds kUntilTheyWork{500};
constexpr std::uint32_t kDay_ms = 86'400'000;

Bytes DigestFrame(std::uint64_t request_id, std::uint64_t revision) {
  wire::Envelope request;
  request.set_request_id(request_id);
  request.mutable_digest_request()->set_timeout_ms(kDay_ms);
  request.mutable_digest_request()->set_at_revision(revision);
  return EncodeEnvelopeFrame(request).value();
}

// Somebody's digests, on a connection of their own: they end with it.
class Digests {
 public:
  static Result<Digests> Start(std::uint16_t port,
                               const std::string& token,
                               std::uint64_t revision,
                               int count) {
    auto socket = LoadSocket::Connect(port, nullptr);
    if (!socket) {
      return Error(socket.error());
    }
    Status status = (*socket)->Send(HelloFrame(token));
    for (int i = 0; i < count && status.ok(); ++i) {
      status = (*socket)->Send(DigestFrame(static_cast<std::uint64_t>(i) + 2, revision));
    }
    if (!status.ok()) {
      return Error(std::move(status));
    }
    std::this_thread::sleep_for(kUntilTheyWork);
    return Digests(*std::move(socket));
  }

  // Nothing but the reply to the Hello has come.
  Status CheckAllAtWork() {
    std::array<std::uint8_t, 16'384> buffer{};
    const LoadSocket::Moved came = socket_->Receive(buffer);
    replies_.Push(ByteSpan(buffer).first(came.bytes));
    int frames = 0;
    while (replies_.Next().value_or(std::nullopt)) {
      ++frames;
    }
    if (came.is_closed || frames != 1) {
      return {StatusCode::kInvalidData,
              StrCat("the digests did not last as long as the queries: ", frames, " replies")};
    }
    return {};
  }

 private:
  explicit Digests(std::unique_ptr<LoadSocket> socket) : socket_(std::move(socket)) {}

  std::unique_ptr<LoadSocket> socket_;
  FrameDecoder replies_;
};

AnswerFigures Ask(AtlasClient& client, const RegionQuery& query) {
  AnswerFigures figures;
  for (int i = 0; i < kQueries; ++i) {
    int tiles = 0;
    const auto begin = Clock::now();
    const auto answer = client.QueryRegion(query, [&tiles](const TileBlob&) {
      ++tiles;
      return Status();
    });
    figures.waits_ms.push_back(
        std::chrono::duration<double, std::milli>(Clock::now() - begin).count());
    figures.in_time += answer && tiles > 0 ? 1 : 0;
  }
  return figures;
}

}  // namespace

Result<AnswerFigures> TimePast(std::uint16_t port,
                               int side,
                               const std::string& token,
                               const std::string& other_token,
                               int digests) {
  ConnectionOptions connection;
  connection.endpoint.port = port;
  connection.client_name = "answer_bench";
  connection.token = token;
  auto client = AtlasClient::Connect(connection);
  if (!client) {
    return Error(client.error());
  }
  auto others = Digests::Start(port, other_token, client->atlas().revision, digests);
  if (!others) {
    return Error(others.error());
  }
  const double middle_m = 0.5 * side * client->profile().tile_size_m();
  RegionQuery query;
  query.disc = {{middle_m, middle_m}, kRadius_m};
  query.is_only_finest = true;
  query.at_revision = client->atlas().revision;
  query.at_timeout = kTimeToAnswer;
  AnswerFigures figures = Ask(*client, query);
  if (Status status = others->CheckAllAtWork(); !status.ok()) {
    return Error(std::move(status));
  }
  return figures;
}

}  // namespace atlas::testing
