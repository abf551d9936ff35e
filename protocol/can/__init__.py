"""Protection of CAN frames: alive counter and CRC."""
