// How large pictures are.
#include <gtest/gtest.h>

#include "tuner/measure/pictures.h"

namespace reliefbench {
namespace {

std::pair<int, int> pictured(int width_px, int height_px) {
  SceneSpec scene;
  scene.scene.width_px = width_px;
  scene.scene.height_px = height_px;
  const SceneSpec made = pictured_scene(scene);
  return {made.scene.width_px, made.scene.height_px};
}

TEST(PicturedScene, HasEnoughPixelsToSeeSomething) {
  EXPECT_EQ(pictured(256, 256), std::pair(512, 512));
  EXPECT_EQ(pictured(300, 200), std::pair(900, 600));
  EXPECT_EQ(pictured(1920, 1080), std::pair(1920, 1080));
  EXPECT_EQ(pictured(512, 512), std::pair(512, 512));
  EXPECT_EQ(pictured(64, 64), std::pair(256, 256));  // at most four times
}

}  // namespace
}  // namespace reliefbench
