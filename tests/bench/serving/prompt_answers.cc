#include "tests/bench/serving/prompt_answers.h"

#include <functional>
#include <thread>
#include <utility>

#include "client/connection/atlas_client.h"
#include "client/connection/keyframe_uploader.h"
#include "tests/bench/serving/wide_upload.h"

namespace atlas::testing {
namespace {

using Clock = std::chrono::steady_clock;
using std::chrono::milliseconds;

// Between two requests, so that whoever asks is no load himself.
constexpr milliseconds kPause{5};

Result<AtlasClient> Connect(std::uint16_t port) {
  ConnectionOptions connection;
  connection.endpoint.port = port;
  connection.client_name = "answer_bench";
  return AtlasClient::Connect(connection);
}

Result<std::vector<double>> TimeEach(milliseconds time, const std::function<Status()>& ask) {
  std::vector<double> waits_ms;
  for (const auto end = Clock::now() + time; Clock::now() < end;) {
    const auto begin = Clock::now();
    if (Status status = ask(); !status.ok()) {
      return Error(std::move(status));
    }
    waits_ms.push_back(std::chrono::duration<double, std::milli>(Clock::now() - begin).count());
    std::this_thread::sleep_for(kPause);
  }
  return waits_ms;
}

}  // namespace

Result<std::vector<double>> TimeStatus(std::uint16_t port, milliseconds time) {
  auto client = Connect(port);
  if (!client) {
    return Error(client.error());
  }
  return TimeEach(time, [&client] {
    const auto status = client->ReadStatus();
    return status ? Status() : status.error();
  });
}

Result<std::vector<double>> TimeUploads(std::uint16_t port,
                                        milliseconds time,
                                        const std::string& session) {
  auto client = Connect(port);
  if (!client) {
    return Error(client.error());
  }
  const Bytes blob = WideBlob(client->profile());
  KeyframeUploader uploader(*client);
  KeyframeKey key{{"prompt", session}, 0};
  return TimeEach(time, [&] {
    ATLAS_RETURN_IF_ERROR(uploader.Upload(WideUpload(client->profile(), blob, key, 0, 0)));
    ++key.sequence;
    return uploader.Finish();
  });
}

}  // namespace atlas::testing
