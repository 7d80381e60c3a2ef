// Fills the atlas of a daemon with many small tiles, so that it knows of far more tiles than a
// reply has room for. Usage: wide_atlas PORT SIDE: keyframes on a grid, SIDE along each side, each
// in a tile of its own, row by row there and back.
#include <cstdint>
#include <cstdlib>
#include <iostream>

#include "client/connection/atlas_client.h"
#include "client/connection/keyframe_uploader.h"
#include "tests/bench/serving/wide_upload.h"

namespace atlas::testing {
namespace {

Status Run(std::uint16_t port, int side) {
  ConnectionOptions connection;
  connection.endpoint.port = port;
  connection.client_name = "wide_atlas";
  auto client = AtlasClient::Connect(connection);
  if (!client) {
    return client.error();
  }
  const Bytes blob = WideBlob(client->profile());
  KeyframeUploader uploader(*client);
  for (int i = 0; i < side * side; ++i) {
    const KeyframeKey key{{"wide", "grid"}, static_cast<std::uint32_t>(i)};
    const int row = i / side;
    const int column = row % 2 == 0 ? i % side : side - 1 - i % side;
    ATLAS_RETURN_IF_ERROR(uploader.Upload(WideUpload(client->profile(), blob, key, column, row)));
  }
  return uploader.Finish();
}

}  // namespace
}  // namespace atlas::testing

int main(int argc, char** argv) {
  if (argc != 3) {
    std::cerr << "usage: wide_atlas PORT SIDE\n";
    return 2;
  }
  const atlas::Status status =
      atlas::testing::Run(static_cast<std::uint16_t>(std::atoi(argv[1])), std::atoi(argv[2]));
  if (!status.ok()) {
    std::cerr << "wide_atlas: " << status.message() << "\n";
  }
  return status.ok() ? 0 : 1;
}
