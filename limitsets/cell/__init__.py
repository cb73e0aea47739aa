"""What stands around the arm: the cavity that is fed, two parts that are assembled, trays that are filled."""
