"""Reads ROS maps, Gazebo worlds and MovingAI's maps, and covers occupied cells with few rectangles. No Drake."""
