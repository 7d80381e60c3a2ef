// A merge as a picture: the ways of its sessions before and after it, seen from above.
#pragma once

#include <string>
#include <utility>
#include <vector>

#include <Eigen/Core>
#include <Eigen/Geometry>

#include "client/render/image.h"

namespace atlas {

struct PictureSession {
  std::string name;
  std::vector<Eigen::Vector2d> before;  // world, metres
  std::vector<Eigen::Vector2d> after;
};

struct MergePicture {
  std::vector<PictureSession> sessions;
  // Where two submaps show the same place, from one middle to the other: as it was before, and
  // after.
  std::vector<std::pair<Eigen::Vector2d, Eigen::Vector2d>> closures_before;
  std::vector<std::pair<Eigen::Vector2d, Eigen::Vector2d>> closures_after;
  std::vector<Eigen::AlignedBox2d> tiles;  // that are fused again, world, metres
};

// Two maps of one scale beside each other, 700 pixels each, closures in grey, and pale blue below
// what is after it the tiles. The eighth session has the first one's colour again, dashed; so do 21
// differ. Of closures that span a tenth of a map, those of sessions that lay far apart, 60 are
// drawn. Without a point the maps are empty.
Image DrawMerge(const MergePicture& picture);

}  // namespace atlas
