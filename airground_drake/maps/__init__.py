"""Maps of others: images of cells, Gazebo worlds, grids of MovingAI; occupied cells as few rectangles. No Drake."""
