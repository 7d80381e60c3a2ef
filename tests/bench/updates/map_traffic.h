// What goes on at an atlas meanwhile: the map is asked for here and there, and a vehicle uploads a
// keyframe a second.
#pragma once

#include <atomic>
#include <string>
#include <thread>
#include <vector>

#include "server/service/atlas_service.h"
#include "server/service/upload_check.h"

namespace atlas::testing {

class MapTraffic {
 public:
  // Until it is stopped; the service must outlive it. Asks around the poses of `uploads`.
  MapTraffic(AtlasService& service, std::vector<UploadRequest> uploads);
  MapTraffic(const MapTraffic&) = delete;
  MapTraffic& operator=(const MapTraffic&) = delete;
  ~MapTraffic() { Stop(); }

  void Stop();
  // Once stopped: members of a JSON object, with a comma before each.
  std::string Report() const;

 private:
  void Query();
  void Upload();

  AtlasService& service_;
  const std::vector<UploadRequest> uploads_;
  std::atomic<bool> is_stopping_ = false;
  std::atomic<int> failed_ = 0;
  std::vector<double> query_ms_;
  std::vector<double> upload_ms_;
  std::thread query_thread_;
  std::thread upload_thread_;
};

}  // namespace atlas::testing
