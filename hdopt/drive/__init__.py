"""What a drive is: gear geometry, wave-generator profiles, the errors of one drive or of many, shipped drives."""
